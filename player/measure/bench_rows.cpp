// SPDX-License-Identifier: Apache-2.0
#include "player/measure/bench_rows.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include "runtime/records/record.h"

#include <nlohmann/json.hpp>

namespace gsc {

const RowKind kBenchRow{R"({"schema":"gsc.bench/)", "a bench", "\"gsc.bench/1\" (schemas/bench-report.schema.json)"};

namespace {

bool isBenchRow(const OrderedJson& row)
{
    const auto schema = row.find("schema");
    if (schema == row.end() || !schema->is_string())
        return false;
    // not what the line starts with where the key occurs twice
    std::string_view version = schema->get_ref<const std::string&>();
    constexpr std::string_view start = "gsc.bench/";
    if (!version.starts_with(start))
        return false;
    version.remove_prefix(start.size());
    return !version.empty() && version.find_first_not_of("0123456789") == std::string_view::npos;
}

} // namespace

RowFile readBenchRows(const std::string& path)
{
    RowFile file = readRows(path, kBenchRow, isBenchRow);
    if (!file.cut_off.empty())
        file.cut_off.resize(file.cut_off.rfind(" and")); // a bench does not look for runs that are missing
    return file;
}

void checkRowOutput(const BenchOptions& options, std::vector<NamedPath> inputs, bool json_summary)
{
    if (options.out.empty())
        return;
    inputs.push_back({options.play.model.file, "the model"});
    const NamedPath out{options.out, "--out"};
    checkOutputsDiffer(std::span(&out, 1), inputs);
    checkStandardOutput(options.out, "--out", json_summary);
    checkAppend(options.out);
}

} // namespace gsc
