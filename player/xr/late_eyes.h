// SPDX-License-Identifier: Apache-2.0
// Locates the eyes again when the drawing of their picture begins (--xr-late). A pose waits while the picture before it is
// drawn; after that the headset predicts the eyes better, and the player knows better when they will see the picture.
#pragma once

#include "player/present/headset/headset.h"

#include <chrono>
#include <memory>
#include <mutex>
#include <vector>

namespace gsc {

// Eyes of all views that LateEyes found for one frame of the headset. Complete once the frame's pictures are drawn.
struct LateLook {
    bool looked = false, found = false;
    std::vector<SpaceEye> eyes;
    int64_t time = 0; // predicted time of display, OpenXR's clock, ns
};

// Display time of a picture whose drawing begins at `now` and takes `draws`. The frame loop woke up at `woken` for the picture
// displayed at `display_time`, wakes up every `period` (ns), and shows the newest picture finished by then.
int64_t seenAt(std::chrono::steady_clock::time_point now, std::chrono::nanoseconds draws,
               std::chrono::steady_clock::time_point woken, int64_t display_time, int64_t period);

// All members may be called from any thread. Only stop() makes the frame loop wait for a call of the runtime.
class LateEyes {
public:
    // waits: each frame waits for the picture of its own pose.
    LateEyes(Headset& headset, bool waits) : m_headset(&headset), m_waits(waits) {}

    void woke(std::chrono::steady_clock::time_point at, const HeadsetFrame& frame);
    void drew(double ms); // reports the time from the begin of a picture to its end
    void stop();          // find() fails from now on: the session is about to end

    // Locates the eyes anew, once for each `look`. Returns false if the headset is not tracked, or if number or lenses of its
    // eyes differ from those `asked` with, whose cameras would not fit.
    bool find(LateLook& look, const std::vector<SpaceEye>& asked);

private:
    int64_t nextTime(); // display time of a picture that is begun now

    std::mutex m_calls; // guards looks and calls of the headset
    Headset* m_headset;
    const bool m_waits;
    std::mutex m_mutex; // guards the members below
    std::chrono::steady_clock::time_point m_woken{};
    HeadsetFrame m_frame;
    double m_draws_ms = 0;
};

} // namespace gsc
