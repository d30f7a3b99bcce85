// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/json_lines.h"

#include <gsc/error.h>
#include <gsc/file/output_paths.h>

#include <cerrno>
#include <span>
#include <vector>

namespace gsc {

JsonLines::JsonLines(const std::string& path, bool overwrite) : m_path(path)
{
    if (path.empty())
        return;
    checkOutput(path, OutputKind::Binary, overwrite);
    m_file = std::fopen(path.c_str(), "w");
    if (m_file == nullptr)
        failOutput(path, "cannot be opened", errno);
}

JsonLines::~JsonLines()
{
    close();
}

void JsonLines::close()
{
    if (m_file != nullptr)
        std::fclose(m_file);
    m_file = nullptr;
}

void JsonLines::add(const OrderedJson& line)
{
    if (m_file == nullptr)
        return;
    const std::string text = jsonText(line, -1) + "\n";
    if (std::fwrite(text.data(), 1, text.size(), m_file) != text.size() || std::fflush(m_file) != 0)
        failOutput(m_path, "cannot be written", errno);
}

void checkJsonLines(const std::string& path, bool overwrite, const std::string& model, const std::string& cameras)
{
    if (path.empty())
        return;
    std::vector<NamedPath> inputs = {{model, "the model"}};
    if (cameras != "stored")
        inputs.push_back({cameras, "the camera file"});
    const NamedPath out{path, "--log"};
    checkOutputsDiffer(std::span(&out, 1), inputs);
    checkOutput(path, OutputKind::Binary, overwrite);
}

} // namespace gsc
