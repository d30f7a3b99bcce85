// SPDX-License-Identifier: Apache-2.0
// How poses are shared among workers, chosen by trial. Pure.
#pragma once

#include "runtime/service/policy/service_time.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

enum class ServiceMode : uint32_t {
    Auto,  // the mode that measures best
    Frame, // each worker draws whole frames in turn: rate
    Eye,   // one worker draws one eye: latency
    Split, // each worker draws a band of both eyes: latency, with more workers
};

const char* serviceModeName(ServiceMode mode);

struct SharePlan {
    ServiceMode mode = ServiceMode::Frame;
    uint32_t workers = 1; // that share it

    bool operator==(const SharePlan&) const = default;
};

// One worker is enough where it is at most this much slower than the best of several.
constexpr double kAsGoodShare = 0.03, kAsGoodMs = 0.05;

// A pose that was drawn.
struct SharedPose {
    ServiceTime at{0};  // when all of it was
    double ms = 0;      // since it was begun
    double busy_ms = 0; // that its part which took longest took a worker
};

// Poses are not alike: on a flight over a city one takes four times what another does, and its neighbour nearly as much as
// itself. So whole frames and each other plan take turns of a few poses, and what a pose takes is held against what one
// worker took for whole frames just before and just after.
class ModeChoice {
public:
    // The rate that is to be held with the least latency, in frames per second; 0 = the highest there is.
    explicit ModeChoice(double wanted_fps) : m_wanted(wanted_fps) {}

    // Plans for so many workers and eyes. merged: one decode serves both eyes, so they stay together. fewer: one worker
    // alone is tried too, which is of no use where a pace says how many draw.
    static std::vector<SharePlan> plansFor(uint32_t workers, uint32_t eyes, bool merged, bool fewer);

    // Tries all of `plans` anew.
    void begin(std::vector<SharePlan> plans);

    [[nodiscard]] const SharePlan& plan() const { return m_trials[m_current].plan; }
    [[nodiscard]] uint64_t serial() const { return m_serial; } // another with every change of plan()
    [[nodiscard]] bool decided() const { return m_decided; }

    // By plan() of `serial`. True if plan() is another afterwards, or has just been decided.
    bool add(uint64_t serial, const SharedPose& pose);

    // Frames per second that the workers could draw by the best plan of those tried so far; 0 = none has been tried.
    [[nodiscard]] double bestRate() const;
    // How the plan was decided, in words.
    [[nodiscard]] const std::string& cause() const { return m_cause; }
    // Is the decided plan worth another look? Frames now take twice or half the time they took when it was tried.
    [[nodiscard]] bool drifted() const;

private:
    struct Counted {
        size_t number = 0; // of the pose, among those of all turns
        SharedPose pose;
        double interval_ms = 0; // from frame to frame, as they were asked for; NaN = the first of a turn
    };
    struct Trial {
        SharePlan plan;
        std::vector<SharedPose> turn; // that it has now
        std::vector<Counted> counted;
        // Milliseconds of a mean frame: since it was begun, from frame to frame, and that it keeps a worker busy; frames
        // per second that the workers could draw.
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
    double m_now_ms = 0; // that frames keep a worker busy by the plan decided, running mean
    uint32_t m_since = 0;
    std::string m_cause;
};

} // namespace gsc
