// SPDX-License-Identifier: Apache-2.0
// State of every pose of a renderer service: waiting, being drawn by which workers, or ended and how. Every pose ends
// exactly once, in one of the ways of PoseEnd, and takeEnded() then reports it once. Knows no thread and no clock.
#pragma once

#include <gsc/frame_types.h>
#include "runtime/service/policy/service_time.h"

#include <cstdint>
#include <deque>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

enum class PoseEnd : uint32_t {
    Shown,   // the pose was delivered
    Late,    // the pose was drawn, but a newer one had been delivered already
    Expired, // the pose was never begun: a newer one was there, or it had waited for too long
    Failed,  // the pose could not be drawn
};

constexpr int kAnyWorker = -1;

// Part of a pose that one worker draws: some eyes, and some columns of them.
struct PosePart {
    uint32_t eyes = 1; // bit mask of the eyes; bit e: eye e is drawn
    ColumnRange columns;
    int worker = kAnyWorker; // the worker that must draw the part; kAnyWorker = any
};

// A part that a worker has taken. If a part is given back and taken again, that is a new job.
struct Job {
    uint64_t pose = 0;
    uint32_t part = 0;
    uint32_t attempt = 0;

    bool operator==(const Job&) const = default;
};

struct LedgerRules {
    bool keeps_all = false; // true: all poses are delivered in order; false: the newest that is drawn is
    ServiceTime timeout{0}; // longest wait of a pose before it is begun, 0 = no limit; has no effect with keeps_all
    uint32_t attempts = 3;  // tries to draw a part before the pose fails
};

struct LedgerCounts {
    uint64_t submitted = 0, ended[4] = {}; // number of poses submitted; number of poses ended, by PoseEnd

    [[nodiscard]] uint64_t of(PoseEnd end) const { return ended[uint32_t(end)]; }
    [[nodiscard]] uint64_t open() const { return submitted - ended[0] - ended[1] - ended[2] - ended[3]; }
};

struct EndedPose {
    uint64_t pose = 0;
    PoseEnd end = PoseEnd::Shown;
    std::exception_ptr error{}; // error of a failed pose, else null
};

class PoseLedger {
public:
    explicit PoseLedger(const LedgerRules& rules) : m_rules(rules) {}

    // Adds a pose at time `now`. Returns the number of the pose, counted from 1.
    uint64_t add(ServiceTime now);

    // Ends poses that have waited longer than LedgerRules::timeout.
    void expire(ServiceTime now);

    // Returns the pose to begin next, 0 if none waits. With keeps_all it is the oldest; otherwise the newest, and
    // older ones that wait end as expired.
    uint64_t next(ServiceTime now);
    void begin(uint64_t pose, std::vector<PosePart> parts); // begins a pose that has not ended, also for a second time

    // Takes a part for this worker, of the oldest pose that has one; none if no pose has.
    std::optional<Job> take(int worker);
    [[nodiscard]] bool isDrawing(const Job& job) const; // returns true until the job ends or is given back

    // drawn(), giveBack() and fail() return false, and do nothing, if the job is no longer being drawn.
    bool drawn(const Job& job);
    // Reports that this worker could not draw the part, but another may: all parts of the pose are drawn again.
    bool giveBack(const Job& job, const std::exception_ptr& error);
    // reports that no worker can draw the part: the pose fails
    bool fail(const Job& job, const std::exception_ptr& error);

    void freeParts(int worker); // reports that a worker has failed: parts that it had to draw are for any worker now
    // reports that no worker is left: all poses that are not drawn yet fail
    void failWaiting(const std::exception_ptr& error);

    [[nodiscard]] bool allDrawn(uint64_t pose) const; // true if all parts of the pose are drawn
    [[nodiscard]] bool isOpen(uint64_t pose) const { return find(pose) != nullptr; }
    [[nodiscard]] uint64_t begun() const; // number of poses that are begun, but neither drawn nor ended
    [[nodiscard]] uint64_t waiting() const;

    // Delivers the pose whose turn it is, if any, and ends it as shown. With keeps_all a failed pose is delivered,
    // too.
    std::optional<EndedPose> deliver();

    [[nodiscard]] bool canDeliver() const;

    // Returns the poses that ended since the last call, in the order of their ends.
    std::vector<EndedPose> takeEnded();

    [[nodiscard]] const LedgerCounts& counts() const { return m_counts; }

private:
    enum class State { Waits, Begun, Drawn, Failed };
    struct Part {
        PosePart what;
        uint32_t attempt = 0;
        enum class State { Open, Drawing, Drawn } state = State::Open;
    };
    struct Pose {
        uint64_t id = 0;
        ServiceTime since{0};
        State state = State::Waits;
        std::vector<Part> parts;
        std::exception_ptr error{}; // error of a pose in State::Failed, until its turn to be delivered comes
    };

    [[nodiscard]] const Pose* find(uint64_t pose) const;
    Pose* find(uint64_t pose) { return const_cast<Pose*>(std::as_const(*this).find(pose)); }
    Part* drawing(const Job& job);
    [[nodiscard]] bool overtaken(const Pose& pose) const { return !m_rules.keeps_all && pose.id < m_shown; }
    void end(uint64_t pose, PoseEnd how, const std::exception_ptr& error = nullptr);
    template <typename Which>
    void endAll(PoseEnd how, const Which& which);
    void failPose(Pose& pose, const std::exception_ptr& error);

    LedgerRules m_rules;
    std::deque<Pose> m_poses; // poses that have not ended, oldest first
    std::vector<EndedPose> m_ended;
    LedgerCounts m_counts;
    uint64_t m_shown = 0; // number of the newest pose that was shown
};

} // namespace gsc
