// SPDX-License-Identifier: Apache-2.0
// How a camera file is read, wherever a command takes one.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Of a file whose poses were moved (nerfstudio's applied_transform and applied_scale).
enum class CamerasTransform : uint8_t {
    Told, // they are taken as they stand, with a warning
    Keep, // the same, asked for, so without one
    Undo  // they are moved back
};

struct CameraReading {
    bool ignore_distortion = false; // a lens that distorts is taken as a pinhole, with a warning, instead of refused
    CamerasTransform transform = CamerasTransform::Told;
    std::vector<std::string>* warnings = nullptr; // takes a sentence for each thing assumed; null: nobody is told

    void warn(std::string text) const
    {
        if (warnings != nullptr)
            warnings->push_back(std::move(text));
    }
};

} // namespace gsc
