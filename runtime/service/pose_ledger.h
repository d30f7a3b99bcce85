// SPDX-License-Identifier: Apache-2.0
// The books of a renderer service: which poses wait, which are drawn by whom, and how each ended. Pure: knows no thread and
// no clock. Every pose ends once, as one of PoseEnd; what ended is told once.
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
    Shown,   // delivered
    Late,    // drawn, when a newer one was delivered already
    Expired, // never begun: a newer one was there, or it had waited for too long
    Failed,  // could not be drawn
};

constexpr int kAnyWorker = -1;

// Part of a pose that one worker draws: eyes and columns.
struct PosePart {
    uint32_t eyes = 1; // bit e: eye e
    ColumnRange columns;
    int worker = kAnyWorker; // for whom it is
};

// A part that a worker is drawing. A part that is given back and taken again is another job.
struct Job {
    uint64_t pose = 0;
    uint32_t part = 0;
    uint32_t attempt = 0;

    bool operator==(const Job&) const = default;
};

struct LedgerRules {
    bool keeps_all = false; // deliver every pose in order; or the newest that is drawn
    ServiceTime timeout{0}; // longest wait of a pose before it is begun, 0 = for ever; not with keeps_all
    uint32_t attempts = 3;  // to draw a part, before the pose fails
};

struct LedgerCounts {
    uint64_t submitted = 0, ended[4] = {}; // by PoseEnd

    [[nodiscard]] uint64_t of(PoseEnd end) const { return ended[uint32_t(end)]; }
    [[nodiscard]] uint64_t open() const { return submitted - ended[0] - ended[1] - ended[2] - ended[3]; }
};

struct EndedPose {
    uint64_t pose = 0;
    PoseEnd end = PoseEnd::Shown;
    std::exception_ptr error{}; // of one that failed
};

class PoseLedger {
public:
    explicit PoseLedger(const LedgerRules& rules) : m_rules(rules) {}

    // A new pose; its number, from 1 in order.
    uint64_t add(ServiceTime now);

    // Ends what has waited for too long.
    void expire(ServiceTime now);

    // The pose to be begun next, 0 if none waits: the oldest if all are kept, otherwise the newest, which ends older ones
    // that wait.
    uint64_t next(ServiceTime now);
    void begin(uint64_t pose, std::vector<PosePart> parts); // also anew, of one that has not ended

    // A part of the oldest pose that has one for this worker.
    std::optional<Job> take(int worker);
    [[nodiscard]] bool isDrawing(const Job& job) const; // nobody has ended it or given it back

    // Each of these ignores a job that is no longer being drawn, and says so with false.
    bool drawn(const Job& job);
    // The worker cannot, another may: all parts of the pose are to be drawn anew.
    bool giveBack(const Job& job, const std::exception_ptr& error);
    bool fail(const Job& job, const std::exception_ptr& error); // nobody can

    void freeParts(int worker);                        // a worker has gone: what was for it is for any
    void failWaiting(const std::exception_ptr& error); // nobody is left: all that is not drawn fails

    [[nodiscard]] bool allDrawn(uint64_t pose) const; // all its parts
    [[nodiscard]] bool isOpen(uint64_t pose) const { return find(pose) != nullptr; }
    [[nodiscard]] uint64_t begun() const; // poses begun and neither drawn nor ended
    [[nodiscard]] uint64_t waiting() const;

    // The pose to be delivered now, if there is one: ends it as shown. One that failed is delivered too if all are kept.
    std::optional<EndedPose> deliver();

    [[nodiscard]] bool canDeliver() const;

    // Poses that ended since the last call, in the order in which they did.
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
        std::exception_ptr error{}; // of State::Failed, which waits for its turn
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
    std::deque<Pose> m_poses; // open ones, oldest first
    std::vector<EndedPose> m_ended;
    LedgerCounts m_counts;
    uint64_t m_shown = 0; // the newest
};

} // namespace gsc
