// SPDX-License-Identifier: Apache-2.0
// Finds out by trial how workers best share poses. No input but its arguments.
#pragma once

#include "runtime/service/policy/service_time.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

enum class ServiceMode : uint32_t {
    Auto,  // the fastest of the modes below, found by measurement
    Frame, // workers draw whole frames in turn, for a high rate
    Eye,   // each worker draws one eye, for a short latency
    Split, // each worker draws a band of both eyes, for a short latency with more workers
};

const char* serviceModeName(ServiceMode mode);

struct SharePlan {
    ServiceMode mode = ServiceMode::Frame;
    uint32_t workers = 1; // number of workers that share a pose

    bool operator==(const SharePlan&) const = default;
};

// One worker alone is chosen if it is slower than the best plan of several by at most this share, or this many
// milliseconds.
constexpr double kAsGoodShare = 0.03, kAsGoodMs = 0.05;

// Times of a pose that was drawn.
struct SharedPose {
    ServiceTime at{0};  // time when the pose's last part was drawn
    double ms = 0;      // time from the begin of the pose to `at`
    double busy_ms = 0; // longest time that one of the parts kept a worker busy
};

// Tries plans and chooses the best. Times of poses differ: on a flight over a city one pose takes four times as long
// as another, but neighbours take nearly the same. So whole frames and each other plan take turns of a few poses, and
// the time of a pose is compared with the times of whole frames that one worker drew just before and after.
class ModeChoice {
public:
    // `wanted_fps`: rate to reach, in frames per second; of the plans that reach it, the one with the shortest latency
    // wins. 0 = the plan with the highest rate wins.
    explicit ModeChoice(double wanted_fps) : m_wanted(wanted_fps) {}

    // Returns the plans that are possible for so many workers and eyes. `merged`: one decode serves both eyes, so one
    // worker draws both. `fewer`: one worker alone is tried, too, which makes no sense if a Pace decides how many
    // draw.
    static std::vector<SharePlan> plansFor(uint32_t workers, uint32_t eyes, bool merged, bool fewer);

    // Forgets earlier trials, and tries all of `plans`.
    void begin(std::vector<SharePlan> plans);

    [[nodiscard]] const SharePlan& plan() const { return m_trials[m_current].plan; }
    [[nodiscard]] uint64_t serial() const { return m_serial; } // number that changes whenever plan() changes
    [[nodiscard]] bool decided() const { return m_decided; }

    // Adds a pose that was drawn by the plan with this serial(). Returns true if plan() changes or has just been
    // decided.
    bool add(uint64_t serial, const SharedPose& pose);

    // Frames per second that the workers could draw by the best of the plans tried so far; 0 = none has been tried.
    [[nodiscard]] double bestRate() const;
    // Describes in words how the plan was decided.
    [[nodiscard]] const std::string& cause() const { return m_cause; }
    // Returns true if the plans should be tried again: frames now take more than twice, or less than half, of their
    // time during the trial.
    [[nodiscard]] bool drifted() const;

private:
    struct Counted {
        size_t number = 0; // number of the pose, counted over all turns
        SharedPose pose;
        double interval_ms = 0; // time since the frame before, by the time of drawing; NaN for the first of a turn
    };
    struct Trial {
        SharePlan plan;
        std::vector<SharedPose> turn; // poses of the plan's current turn
        std::vector<Counted> counted;
        // Mean times of a frame in milliseconds: from its begin until it is drawn; from one frame to the next; that
        // one worker is busy. `rate`: frames per second that the workers could draw.
        double latency = 0, interval = 0, busy = 0, rate = 0;

        [[nodiscard]] uint32_t turns() const { return plan.mode == ServiceMode::Frame ? plan.workers : 1; }
        // Returns milliseconds to compare plans by, less is better: the latency if the plan reaches the rate `wanted`,
        // else the time from frame to frame.
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
    std::vector<Trial> m_trials{1}; // trials of the plans; the first plan draws whole frames
    size_t m_current = 0;
    uint32_t m_turn = 0;
    size_t m_poses = 0;
    uint64_t m_serial = 0;
    bool m_decided = true;
    double m_now_ms = 0; // running mean of the time that a frame keeps a worker busy, by the chosen plan
    uint32_t m_since = 0;
    std::string m_cause;
};

} // namespace gsc
