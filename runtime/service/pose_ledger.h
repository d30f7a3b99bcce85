// SPDX-License-Identifier: Apache-2.0
// State of every pose of a renderer service: waiting, being drawn by which workers, or ended and how. Pure: knows no thread
// and no clock. Every pose ends exactly once, as one of PoseEnd, and is then reported once (takeEnded()).
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
    int worker = kAnyWorker; // the worker that draws it
};

// A part in the hands of a worker. A part that is given back and taken again is a new job.
struct Job {
    uint64_t pose = 0;
    uint32_t part = 0;
    uint32_t attempt = 0;

    bool operator==(const Job&) const = default;
};

struct LedgerRules {
    bool keeps_all = false; // deliver every pose in order; or the newest that is drawn
    ServiceTime timeout{0}; // longest wait of a pose before it is begun, 0 = for ever; not with keeps_all
    uint32_t attempts = 3;  // tries to draw a part, before the pose fails
};

struct LedgerCounts {
    uint64_t submitted = 0, ended[4] = {}; // ended: by PoseEnd

    [[nodiscard]] uint64_t of(PoseEnd end) const { return ended[uint32_t(end)]; }
    [[nodiscard]] uint64_t open() const { return submitted - ended[0] - ended[1] - ended[2] - ended[3]; }
};

struct EndedPose {
    uint64_t pose = 0;
    PoseEnd end = PoseEnd::Shown;
    std::exception_ptr error{}; // error of a pose that failed
};

class PoseLedger {
public:
    explicit PoseLedger(const LedgerRules& rules) : m_rules(rules) {}

    // Adds a pose. Returns its number, counted from 1.
    uint64_t add(ServiceTime now);

    // Ends poses that have waited longer than LedgerRules::timeout.
    void expire(ServiceTime now);

    // The pose to be begun next, 0 if none waits: the oldest if all are kept, otherwise the newest, which ends older ones
    // that wait.
    uint64_t next(ServiceTime now);
    void begin(uint64_t pose, std::vector<PosePart> parts); // begins a pose that has not ended; also anew

    // Takes a part of the oldest pose that has one for this worker.
    std::optional<Job> take(int worker);
    [[nodiscard]] bool isDrawing(const Job& job) const; // false once the job has ended or was given back

    // These return false, and do nothing, for a job that is no longer being drawn.
    bool drawn(const Job& job);
    // The worker cannot draw the part, another may: all parts of the pose are to be drawn anew.
    bool giveBack(const Job& job, const std::exception_ptr& error);
    bool fail(const Job& job, const std::exception_ptr& error); // no worker can draw the part: the pose fails

    void freeParts(int worker);                        // a worker has gone: its parts are for any worker
    void failWaiting(const std::exception_ptr& error); // no worker is left: all poses that are not drawn fail

    [[nodiscard]] bool allDrawn(uint64_t pose) const; // all its parts
    [[nodiscard]] bool isOpen(uint64_t pose) const { return find(pose) != nullptr; }
    [[nodiscard]] uint64_t begun() const; // poses begun and neither drawn nor ended
    [[nodiscard]] uint64_t waiting() const;

    // Delivers the pose that is due, if any, and ends it as shown. A failed pose is delivered too with keeps_all.
    std::optional<EndedPose> deliver();

    [[nodiscard]] bool canDeliver() const;

    // Returns the poses that ended since the last call, in order.
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
        std::exception_ptr error{}; // in State::Failed, until its turn to be delivered comes
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
    uint64_t m_shown = 0; // number of the newest shown pose
};

} // namespace gsc
