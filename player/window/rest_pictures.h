// SPDX-License-Identifier: Apache-2.0
// Decides whether a view at rest is drawn again because that shows more: frames with detail make some of their coarse
// copies each, and a FrameGuard takes reductions back frame by frame. Pure.
#pragma once

#include <gsc/frame_types.h>

#include <cstdint>

namespace gsc {

class RestPictures {
public:
    // A frame that forgets all copies makes none; the next one does. So two frames are needed to tell that none is to
    // be made.
    static constexpr uint32_t kUnmade = 2;
    // Copies are all made anew in eight frames; some are for good, such as those too near for two eyes, or where memory is
    // short: pictures that follow for them.
    static constexpr uint32_t kMost = 60;
    // Pictures drawn with reductions after a change of the guard: then it knows whether there is time to take some back
    // (FrameGuard::kRemade).
    static constexpr uint32_t kGiveBack = 8;

    void changed() { *this = {}; } // view or settings, also by the guard

    // Takes the newest picture's counts and FrameGuard::gaveUp(). Returns true if the view is to be drawn again.
    [[nodiscard]] bool goOn(const CoarseCounts& drawn, bool gave_up);

private:
    uint32_t m_pictures = 0; // since changed()
    uint32_t m_unmade = 0;   // pictures in a row that had no stale copy and made none
};

} // namespace gsc
