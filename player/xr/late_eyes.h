// SPDX-License-Identifier: Apache-2.0
// Where eyes are when the drawing of their picture begins (--xr-late). A pose waits while the picture before it is drawn; by
// then the headset knows better where the eyes will be, and the player when they will see the picture.
#pragma once

#include "player/present/headset/headset.h"

#include <chrono>
#include <memory>
#include <mutex>
#include <vector>

namespace gsc {

// Eyes of all views that LateEyes found for one frame of the headset. Complete when its pictures are there.
struct LateLook {
    bool looked = false, found = false;
    std::vector<SpaceEye> eyes;
    int64_t time = 0; // that they were located for
};

// When a picture is seen that is begun at `now`: the frame loop woke up at `woken` for what is seen at `display_time`, wakes
// up every `period` (ns) from then on, and takes a picture that is there by then.
int64_t seenAt(std::chrono::steady_clock::time_point now, std::chrono::nanoseconds draws,
               std::chrono::steady_clock::time_point woken, int64_t display_time, int64_t period);

// All members from any thread. The frame loop waits for no call of the runtime but in stop().
class LateEyes {
public:
    // waits: each frame shows the picture of its own pose.
    LateEyes(Headset& headset, bool waits) : m_headset(&headset), m_waits(waits) {}

    void woke(std::chrono::steady_clock::time_point at, const HeadsetFrame& frame);
    void drew(double ms); // from the begin of a picture until it was there
    void stop();          // from now on nothing is found: the session is about to end

    // Locates the eyes that were `asked` with, once for every look. False where the headset is not tracked, and where it has
    // another number of them, or other lenses: what was made for those that were asked with would not fit.
    bool find(LateLook& look, const std::vector<SpaceEye>& asked);

private:
    int64_t nextTime(); // at which a picture that is begun now will be seen

    std::mutex m_calls; // guards looks, and the headset while it is asked
    Headset* m_headset;
    const bool m_waits;
    std::mutex m_mutex; // guards what follows
    std::chrono::steady_clock::time_point m_woken{};
    HeadsetFrame m_frame;
    double m_draws_ms = 0;
};

} // namespace gsc
