// SPDX-License-Identifier: Apache-2.0
#include "player/measure/row_output.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>

#include <span>

namespace gsc {

void checkRowOutput(const std::string& out, const std::vector<NamedPath>& inputs, bool json_summary)
{
    if (out.empty())
        return;
    const NamedPath output{out, "--out"};
    checkOutputsDiffer(std::span(&output, 1), inputs);
    checkStandardOutput(out, "--out", json_summary);
    checkAppend(out);
}

void refuseMixed(const std::string& where, const RunRow& row)
{
    throw Error(ErrorCode::Usage, where,
                row.shard       ? "is a row of a shard"
                : row.stability ? "is a row of gsc-play stability"
                                : "is a row of gsc bake --curve",
                "rows of gsc-play bench", "choose another --out");
}

} // namespace gsc
