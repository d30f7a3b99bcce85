// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/run_rows.h"

#include "format/error.h"
#include "player/report/report_parts.h"
#include "player/sweep/row_file.h"
#include "player/sweep/run_row.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace gsc {

namespace {

const RowKind kRunRow{R"({"schema":"gsc.run/1",)", "a sweep",
                      "\"gsc.run/1\" (schemas/run.schema.json) with the numbers of this version"};

// Has a row what a sweep that goes on needs of it?
bool isRow(const OrderedJson& row)
{
    try {
        if (row.at("schema") != "gsc.run/1" || !row.at("config").at("id").is_string())
            return false;
        const OrderedJson& decoded = row.at("per_frame").at("decoded");
        if (!decoded.is_array() || decoded.empty() || !row.at("config").at("eyes").is_number_integer() ||
            row.at("config").at("eyes").get<int>() < 1)
            return false;
        (void)runTableLine(row);
        return std::all_of(decoded.begin(), decoded.end(), [](const OrderedJson& v) { return v.is_number(); });
    } catch (const OrderedJson::exception&) {
        return false;
    }
}

} // namespace

RunRows::RunRows(const std::string& path, std::string& cut_off) : m_path(path)
{
    const RowFile file = readRows(path, kRunRow, [this](OrderedJson&& row) {
        const bool good = isRow(row);
        if (good)
            insert(std::move(row));
        return good;
    });
    cut_off = file.cut_off;
    m_bytes = file.bytes;
    m_whole = file.whole + (file.needs_end ? 1 : 0); // which comes with the next row
}

const OrderedJson* RunRows::find(const std::string& id) const
{
    const auto found = m_rows.find(id);
    return found == m_rows.end() ? nullptr : &found->second;
}

void RunRows::insert(OrderedJson row)
{
    const std::string id = row.at("config").at("id").get<std::string>();
    m_rows.insert_or_assign(id, std::move(row));
}

void RunRows::append(const OrderedJson& row)
{
    if (!m_path.empty()) {
        const std::string line = jsonText(row, -1);
        std::error_code code;
        const bool is_file = !isStandardOutput(m_path) && std::filesystem::exists(m_path, code);
        const uint64_t bytes = is_file ? std::filesystem::file_size(m_path, code) : 0;
        if (is_file && !code && bytes != m_bytes)
            throw Error(ErrorCode::Io,
                        formatString("%s: has %llu bytes, expected the %llu that were there before: another program "
                                     "writes to it; give every sweep an --out of its own",
                                     m_path.c_str(), static_cast<unsigned long long>(bytes),
                                     static_cast<unsigned long long>(m_bytes)));
        addRow(m_path, kRunRow, line);
        m_whole += line.size() + 1;
        m_bytes = m_whole;
    }
    insert(row);
}

} // namespace gsc
