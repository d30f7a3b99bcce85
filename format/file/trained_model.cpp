// SPDX-License-Identifier: Apache-2.0
#include "format/file/trained_model.h"

#include <filesystem>
#include <fstream>
#include <string_view>

namespace gsc {

namespace {

std::string nameOf(const std::string& model)
{
    std::error_code none;
    std::filesystem::path path = std::filesystem::absolute(model, none).lexically_normal();
    if (path.filename().empty())
        path = path.parent_path();
    return path.stem().string() + ".gsc";
}

} // namespace

bool isTrainedModel(const std::string& path)
{
    std::error_code none;
    const std::filesystem::file_status status = std::filesystem::status(path, none);
    if (status.type() == std::filesystem::file_type::directory)
        return true;
    if (status.type() != std::filesystem::file_type::regular)
        return false;
    char head[4] = {};
    std::ifstream(path, std::ios::binary).read(head, sizeof(head));
    const std::string_view begins(head, sizeof(head));
    return begins == "ply\n" || begins == "ply\r";
}

TemporaryGsc::TemporaryGsc(const std::string& model)
    : m_folder(temporaryFolder() + "/gsc-model", TemporaryKind::Folder, 0700),
      m_path(m_folder.path() + "/" + nameOf(model))
{
}

} // namespace gsc
