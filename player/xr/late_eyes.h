// SPDX-License-Identifier: Apache-2.0
// Locates the eyes again when the drawing of their picture begins (--xr-late). A pose waits while the picture before
// it is drawn; after that wait the headset predicts the eyes better, and the display time of the picture is known
// better.
#pragma once

#include "player/present/headset/headset.h"

#include <chrono>
#include <memory>
#include <mutex>
#include <vector>

namespace gsc {

// Eyes of all views that LateEyes located for one frame of the headset. Complete once the pictures of that frame are
// drawn.
struct LateLook {
    bool looked = false, found = false;
    std::vector<SpaceEye> eyes;
    int64_t time = 0; // display time that the eyes are predicted for, OpenXR's clock, ns
};

// Predicts the display time of a picture whose drawing begins at `now` and takes `draws`. The frame loop woke up at
// `woken` for the picture displayed at `display_time`; it wakes up every `period` ns and shows the newest picture
// finished by then.
int64_t seenAt(std::chrono::steady_clock::time_point now, std::chrono::nanoseconds draws,
               std::chrono::steady_clock::time_point woken, int64_t display_time, int64_t period);

// All members may be called from any thread. Only stop() may wait for a call of the OpenXR runtime.
class LateEyes {
public:
    // `waits`: each frame waits for the picture of its own pose.
    LateEyes(Headset& headset, bool waits) : m_headset(&headset), m_waits(waits) {}

    void woke(std::chrono::steady_clock::time_point at, const HeadsetFrame& frame);
    void drew(double ms); // reports the milliseconds that drawing a picture took
    void stop();          // makes every later find() fail: the session is about to end

    // Locates the eyes anew, once for each `look`. Returns false if the headset is not tracked, or if the number or
    // the lenses of the eyes differ from those in `asked`, so that the submitted cameras would not fit.
    bool find(LateLook& look, const std::vector<SpaceEye>& asked);

private:
    int64_t nextTime(); // returns the display time of a picture whose drawing begins now

    std::mutex m_calls; // guards LateLooks and calls of the headset
    Headset* m_headset;
    const bool m_waits;
    std::mutex m_mutex; // guards the members below
    std::chrono::steady_clock::time_point m_woken{};
    HeadsetFrame m_frame;
    double m_draws_ms = 0;
};

} // namespace gsc
