// SPDX-License-Identifier: Apache-2.0
#include "player/measure/row_output.h"

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

} // namespace gsc
