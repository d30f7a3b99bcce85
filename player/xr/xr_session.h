// SPDX-License-Identifier: Apache-2.0
// Session of a headset that the player draws for: begins frame after frame, and ends each at once with the newest
// finished picture and the pose that it was drawn for.
#pragma once

#include "player/frames/shots.h"
#include "player/xr/hands.h"
#include "player/xr/ride.h"
#include "player/xr/view_lenses.h"
#include "player/xr/view_request.h"
#include "player/xr/view_source.h"
#include "player/xr/xr.h"
#include "player/xr/xr_log.h"
#include "runtime/view/frame_guard.h"

#include <chrono>
#include <deque>

namespace gsc {

class XrSession {
public:
    XrSession(const XrOptions& options, std::shared_ptr<const Scene> scene, Headset& headset, Reporter& log);
    ~XrSession();
    XrSession(const XrSession&) = delete;
    XrSession& operator=(const XrSession&) = delete;

    bool step();        // takes one turn; returns false if the session is over. Throws Error
    void requestExit(); // asks the runtime to end the session soon
    XrSummary finish(); // ends the session and returns its numbers; throws Error(Io) if the place cannot be stored
    std::string keepPlace() const; // writes the place file and returns its path. Throws Error(Io)

private:
    using Clock = std::chrono::steady_clock;

    void frame();
    void move(const HeadsetFrame& frame, const HeadsetInput& input);
    void ask(const HeadsetFrame& frame, XrFrame& line);
    void take(XrFrame& line);
    void forgetPictures(); // drops pictures, finished or not, that show another place or are too old
    // height of the start's eyes above the space's origin, metres
    [[nodiscard]] double eyeHeight() const { return m_options.stage ? kEyeHeight : 0; }
    void start(); // puts the viewer at the start
    EyeDepths drawDepths(const Shot& shot, uint32_t eyes);

    XrOptions m_options;
    std::shared_ptr<const Scene> m_scene;
    Headset& m_headset;
    Reporter& m_report;
    std::vector<Shot> m_shots;
    double m_metre;
    double m_floor; // height of the floor in the headset's space, metres
    Placement m_place;
    Hands m_hands;
    std::optional<Ride> m_ride;
    std::optional<FrameGuard> m_guard;
    FrameOptions m_frame_options;
    std::shared_ptr<LateEyes> m_late; // shared with pictures that are being drawn; null: --xr-late was not given
    ViewLenses m_lenses;
    std::unique_ptr<XrLog> m_log;
    ViewSource m_source;            // renders the views; declared late, because its destructor waits for the GPU
    std::deque<DrawnViews> m_shown; // pictures of frames, the newest last; the GPU may still read the one before

    Clock::time_point m_start = Clock::now();
    std::vector<SpaceEye> m_eyes; // eyes of the views, as located last
    uint64_t m_frame = 0;
    int64_t m_first_time = 0, m_last_time = 0; // display times of the first and the last frame
    double m_lag = 1; // running mean of the refreshes from locating the eyes to showing their picture
    bool m_exits = false, m_moved = true;
    bool m_stale = true;       // no picture drawn so far may be shown
    uint64_t m_valid_from = 1; // pictures are shown only if their eyes were located in this frame or later
};

} // namespace gsc
