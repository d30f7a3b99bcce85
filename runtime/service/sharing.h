// SPDX-License-Identifier: Apache-2.0
// Shares poses among workers: by which plan, and what each draws of a pose by that plan. Every call is
// made with the service's mutex held.
#pragma once

#include "runtime/service/policy/bands.h"
#include "runtime/service/rates.h"
#include "runtime/service/workers.h"

namespace gsc {

class Sharing {
public:
    // `changed` wakes the workers' threads.
    Sharing(const ServiceOptions& options, const ServiceClock& clock, TraceRecord& trace, PoseQueue& poses,
            const ServiceWorkers& workers, std::condition_variable& changed)
        : m_options(options), m_clock(clock), m_trace(trace), m_poses(poses), m_workers(workers), m_changed(changed),
          m_choice(options.pace.min_fps)
    {
    }

    // Parts that a worker may have in flight, and poses that may be begun where workers share each.
    [[nodiscard]] size_t partsAhead() const { return m_options.keeps_all && m_choice.decided() ? kFramesInFlight : 1; }
    // The part that a worker draws next, which draws `flying` already: of a pose begun before or of the next, which is cut
    // then. None: it has nothing to do until something changes.
    std::optional<Job> take(const Worker& worker, size_t flying);
    // A part is drawn, which `work` says. If it was the last one its pose is due, and all learn from it.
    void finish(const Job& job, PoseWork& work);

    // Frames per second that workers start and stop by.
    [[nodiscard]] double paceRate() const;
    [[nodiscard]] double foreseen(double rate) const { return m_rates.foreseen(rate, m_clock.now()); }

    void fill(ServiceStats& stats) const; // plan and rates

private:
    SharePlan planFor(const PoseWork& work, uint32_t workers);
    [[nodiscard]] std::vector<PosePart> cut(const PoseWork& work, std::span<const int> workers);
    void learn(const PoseWork& work);

    const ServiceOptions& m_options;
    const ServiceClock& m_clock;
    TraceRecord& m_trace;
    PoseQueue& m_poses;
    const ServiceWorkers& m_workers;
    std::condition_variable& m_changed;
    ModeChoice m_choice;
    std::vector<SharePlan> m_tried; // by m_choice
    uint64_t m_tried_kind = 0;      // of the poses that they were tried with
    ServiceTime m_tried_at{0};
    BandBalance m_bands;
    Rates m_rates;
};

} // namespace gsc
