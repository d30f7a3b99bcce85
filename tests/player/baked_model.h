// SPDX-License-Identifier: Apache-2.0
// A trained model, baked into a temporary folder that goes away with the object.
#pragma once

#include "convert/bake/bake.h"
#include "convert/input/checkpoint.h"

#include <filesystem>
#include <string>

#include <unistd.h>

namespace gsc::test {

class BakedModel {
public:
    // `tag` keeps the folders of tests apart that run at the same time.
    BakedModel(const std::string& model, const char* tag)
        : m_folder(std::filesystem::temp_directory_path() /
                   (std::string("gsc_") + tag + "_" + std::to_string(getpid()) + "_" +
                    std::filesystem::path(model).filename().string()))
    {
        std::filesystem::create_directories(m_folder);
        BakeOptions options;
        options.output = path();
        options.overwrite = true;
        (void)bake(readCheckpoint(model, {}), options, [](const char*, uint64_t, uint64_t) {});
    }
    ~BakedModel()
    {
        std::error_code ignored;
        std::filesystem::remove_all(m_folder, ignored);
    }
    BakedModel(const BakedModel&) = delete;
    BakedModel& operator=(const BakedModel&) = delete;

    [[nodiscard]] std::string path() const { return (m_folder / "model.gsc").string(); }

private:
    std::filesystem::path m_folder;
};

} // namespace gsc::test
