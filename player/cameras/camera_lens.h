// SPDX-License-Identifier: Apache-2.0
// What a camera file says of a lens beside its focal length: distortion, and the pixel its axis meets.
#pragma once

#include "player/cameras/json_fields.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

// The keys of a frame, which stand for those of the whole file where the frame lacks them.
struct LensKeys {
    const JsonObject& frame;
    const JsonObject* file = nullptr; // null: the frame stands alone

    // Where `key` is read, null if it is nowhere.
    [[nodiscard]] const JsonObject* holder(const char* key) const;
};

// Finds what no pinhole shows: a coefficient k1 to k6, p1, p2 that is not 0, another camera model, a fisheye lens.
class DistortionCheck {
public:
    // `ignored`, if given, takes one sentence for the file; without it such a lens is refused.
    DistortionCheck(std::string file, std::vector<std::string>* ignored);

    // Throws Error(Unsupported) for a lens that is not ignored, Error(InvalidFile) for a key of the wrong type.
    void add(const LensKeys& lens);
    // After the last camera.
    void finish();

private:
    void found(const JsonObject& holder, const char* key);

    std::string m_file, m_first;
    std::vector<std::string>* m_ignored;
    size_t m_cameras = 0, m_distorted = 0;
};

// Pixels from where the axis meets the image (cx, cy) to the middle of `width` x `height`, right and down; 0 for what
// is not stated. Throws Error(InvalidFile), also where cx or cy is there and the size is not (0).
struct MiddleOffset {
    double x = 0, y = 0;
};
MiddleOffset readMiddleOffset(const LensKeys& lens, uint32_t width, uint32_t height);
// For a file of our own, which has "views" instead: throws Error(InvalidFile) where cx or cy is there.
void refuseMiddleOffset(const LensKeys& lens);

} // namespace gsc
