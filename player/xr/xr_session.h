// SPDX-License-Identifier: Apache-2.0
// A headset while the player draws for it: one frame of it after the other, each ended at once with the newest finished
// picture, and the pose that picture was drawn for.
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

    bool step();                   // false: the session is over. Throws Error
    void requestExit();            // it is over soon
    XrSummary finish();            // throws Error(Io) where the place cannot be stored
    std::string keepPlace() const; // its file. Throws Error(Io)

private:
    using Clock = std::chrono::steady_clock;
    static constexpr double kEyeHeight = 1.6; // metres, of a viewer who stands

    void frame();
    void move(const HeadsetFrame& frame, const HeadsetInput& input);
    void ask(const HeadsetFrame& frame, XrFrame& line);
    void take(XrFrame& line);
    void forgetPictures(); // that were drawn or are being drawn: of another place, or of long ago
    [[nodiscard]] double eyeHeight() const { return m_options.stage ? kEyeHeight : 0; } // above the space's origin
    [[nodiscard]] Placement startPlace() const;

    XrOptions m_options;
    std::shared_ptr<const Scene> m_scene;
    Headset& m_headset;
    Reporter& m_report;
    std::vector<Shot> m_shots;
    double m_metre;
    double m_floor; // its height in the headset's space, metres
    Placement m_place;
    Hands m_hands;
    std::optional<Ride> m_ride;
    std::optional<FrameGuard> m_guard;
    FrameOptions m_frame_options;
    std::shared_ptr<LateEyes> m_late; // also held by what is being drawn; null: --xr-late was not asked for
    ViewLenses m_lenses;
    std::unique_ptr<XrLog> m_log;
    ViewSource m_source;            // last but for what it drew: its end waits for the GPU
    std::deque<DrawnViews> m_shown; // newest last; the one before may still be read

    Clock::time_point m_start = Clock::now();
    std::vector<SpaceEye> m_eyes; // as they were located last
    uint64_t m_frame = 0;
    int64_t m_first_time = 0, m_last_time = 0; // display times
    double m_lag = 1;                          // refreshes that pictures come after their pose, about
    bool m_exits = false, m_moved = true;
    bool m_stale = true;       // nothing that was drawn may be shown
    uint64_t m_valid_from = 1; // frame in which eyes of a picture to be shown were located, or later
};

} // namespace gsc
