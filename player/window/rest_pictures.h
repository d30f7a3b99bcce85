// SPDX-License-Identifier: Apache-2.0
// Decides whether a view at rest is drawn again because the next picture will show more: each frame with detail makes
// only some of the missing coarse copies, and a FrameGuard takes its reductions back frame by frame. No input but its
// arguments.
#pragma once

#include <gsc/frame_types.h>

#include <cstdint>

namespace gsc {

class RestPictures {
public:
    // Number of pictures in a row without new copies after which none is expected. A frame that forgets all copies
    // makes none, but the next one does; so it takes two.
    static constexpr uint32_t kUnmade = 2;
    // Most pictures that are drawn to make copies. Eight frames renew all copies; some can never be made, such as
    // those too near for two eyes, or if memory is short.
    static constexpr uint32_t kMost = 60;
    // Pictures drawn with reductions after the guard changed them: then the guard knows whether there is time to take
    // some back (FrameGuard::kRemade).
    static constexpr uint32_t kGiveBack = 8;

    void changed() { *this = {}; } // call if the view or the settings change, by the guard too

    // Takes the counts of the newest picture, and FrameGuard::gaveUp(). Returns true if the view is to be drawn again.
    [[nodiscard]] bool goOn(const CoarseCounts& drawn, bool gave_up);

private:
    uint32_t m_pictures = 0; // number of pictures since changed()
    uint32_t m_unmade = 0;   // number of the last pictures in a row that had no stale copy and made none
};

} // namespace gsc
