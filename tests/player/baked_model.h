// SPDX-License-Identifier: Apache-2.0
// A trained model, baked into a temporary folder that goes away with the object.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/write/write_gsc.h"
#include "tests/support/temporary_folder.h"

#include <string>

namespace gsc::test {

class BakedModel {
public:
    explicit BakedModel(const std::string& model)
    {
        WriteOptions options;
        options.output = path();
        (void)writeGsc(readCheckpoint(model, {}), options, [](const char*, uint64_t, uint64_t) {});
    }

    [[nodiscard]] std::string path() const { return m_folder / "model.gsc"; }

private:
    TemporaryFolder m_folder;
};

} // namespace gsc::test
