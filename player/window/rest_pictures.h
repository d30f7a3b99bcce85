// SPDX-License-Identifier: Apache-2.0
// Whether a view at rest is drawn again because that shows more: frames with detail make some of their coarse copies each,
// and a FrameGuard gives back frame by frame. Pure.
#pragma once

#include <gsc/frame_types.h>

#include <cstdint>

namespace gsc {

class RestPictures {
public:
    // A frame that forgets all copies makes none; one behind it does. So it takes two to tell that none is to be made.
    static constexpr uint32_t kUnmade = 2;
    // Copies are all made anew in eight frames; some are for good, such as those too near for two eyes, or where memory is
    // short: pictures that follow for them.
    static constexpr uint32_t kMost = 60;
    // Pictures with something given up that follow what the guard changed: it knows then whether there is time to give it
    // back (FrameGuard::kRemade).
    static constexpr uint32_t kGiveBack = 8;

    void changed() { *this = {}; } // view or settings, also by the guard

    // The newest picture's counts and FrameGuard::gaveUp(). True: it is to be drawn again.
    [[nodiscard]] bool goOn(const CoarseCounts& drawn, bool gave_up);

private:
    uint32_t m_pictures = 0; // since changed()
    uint32_t m_unmade = 0;   // the last so many had no copy that is stale, and made none
};

} // namespace gsc
