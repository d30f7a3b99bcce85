// SPDX-License-Identifier: Apache-2.0
// Choice, by trial, of how workers share poses. Pure.
#pragma once

#include "runtime/service/policy/service_time.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

enum class ServiceMode : uint32_t {
    Auto,  // the fastest mode, by measurement
    Frame, // each worker draws whole frames in turn: rate
    Eye,   // one worker draws one eye: latency
    Split, // each worker draws a band of both eyes: latency, with more workers
};

const char* serviceModeName(ServiceMode mode);

struct SharePlan {
    ServiceMode mode = ServiceMode::Frame;
    uint32_t workers = 1; // workers that share a pose

    bool operator==(const SharePlan&) const = default;
};

// One worker alone is chosen if it is at most this much slower than the best plan of several.
constexpr double kAsGoodShare = 0.03, kAsGoodMs = 0.05;

// A pose that was drawn.
struct SharedPose {
    ServiceTime at{0};  // when its last part was drawn
    double ms = 0;      // from its begin
    double busy_ms = 0; // longest time that one of its parts kept a worker busy
};

// Times of poses differ: on a flight over a city one pose takes four times as long as another, but neighbours take nearly
// the same. So whole frames and each other plan take turns of a few poses, and the time of a pose is compared with that of
// whole frames, drawn by one worker just before and just after.
class ModeChoice {
public:
    // `wanted_fps`: rate to hold, frames per second; the plan of least latency that holds it wins. 0 = the highest rate.
    explicit ModeChoice(double wanted_fps) : m_wanted(wanted_fps) {}

    // Plans for so many workers and eyes. merged: one decode serves both eyes, so they stay together. fewer: try one
    // worker alone, too; useless where a Pace decides how many draw.
    static std::vector<SharePlan> plansFor(uint32_t workers, uint32_t eyes, bool merged, bool fewer);

    // Tries all of `plans` anew.
    void begin(std::vector<SharePlan> plans);

    [[nodiscard]] const SharePlan& plan() const { return m_trials[m_current].plan; }
    [[nodiscard]] uint64_t serial() const { return m_serial; } // changes with plan()
    [[nodiscard]] bool decided() const { return m_decided; }

    // Adds a pose drawn by the plan of `serial`. Returns true if plan() changed or has just been decided.
    bool add(uint64_t serial, const SharedPose& pose);

    // Frames per second that the workers could draw by the best plan of those tried so far; 0 = none has been tried.
    [[nodiscard]] double bestRate() const;
    // How the plan was decided, in words.
    [[nodiscard]] const std::string& cause() const { return m_cause; }
    // True if the plan should be tried anew: frames take twice or half the time they took when it was tried.
    [[nodiscard]] bool drifted() const;

private:
    struct Counted {
        size_t number = 0; // number of the pose, counted over all turns
        SharedPose pose;
        double interval_ms = 0; // from frame to frame, as they were asked for; NaN = the first of a turn
    };
    struct Trial {
        SharePlan plan;
        std::vector<SharedPose> turn; // poses of the turn under way
        std::vector<Counted> counted;
        // Means per frame, milliseconds: from its begin, from frame to frame, and busy time of a worker; rate: frames per
        // second that the workers could draw.
        double latency = 0, interval = 0, busy = 0, rate = 0;

        [[nodiscard]] uint32_t turns() const { return plan.mode == ServiceMode::Frame ? plan.workers : 1; }
        // Milliseconds, less is better: latency where the rate is held, otherwise from frame to frame.
        [[nodiscard]] double score(double wanted) const
        {
            return wanted <= 0 ? interval : holds(wanted) ? latency : 1000 / rate;
        }
        [[nodiscard]] bool holds(double wanted) const { return wanted <= 0 || rate >= wanted; }
        void endTurn(size_t first_number);
    };

    [[nodiscard]] double wholeMs(size_t number, bool& jumps) const;
    void compare();
    void decide();

    double m_wanted;
    std::vector<Trial> m_trials{1}; // the first draws whole frames
    size_t m_current = 0;
    uint32_t m_turn = 0;
    size_t m_poses = 0;
    uint64_t m_serial = 0;
    bool m_decided = true;
    double m_now_ms = 0; // time that a frame keeps a worker busy by the chosen plan, running mean
    uint32_t m_since = 0;
    std::string m_cause;
};

} // namespace gsc
