// SPDX-License-Identifier: Apache-2.0
// Divides poses among workers: chooses the plan, and cuts each pose into parts by it. The service's mutex must be held
// in every call.
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

    // Most parts in flight for a worker; if workers share each pose, also the most poses that are begun at a time.
    [[nodiscard]] size_t partsAhead() const { return m_options.keeps_all && m_choice.decided() ? kFramesInFlight : 1; }
    // Takes the next part for a worker that has `flying` parts in flight: of a pose that is begun already, else of the
    // next pose, which is then cut into parts. None: the worker must wait until something changes.
    std::optional<Job> take(const Worker& worker, size_t flying);
    // Called when a part is drawn and noted in `work`. After the last part the pose can be delivered, and rates and
    // bands learn from it.
    void finish(const Job& job, PoseWork& work);

    // Frames per second by which workers are started and stopped.
    [[nodiscard]] double paceRate() const;
    [[nodiscard]] double foreseen(double rate) const { return m_rates.foreseen(rate, m_clock.now()); }

    void fill(ServiceStats& stats) const; // sets plan and rates

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
    std::vector<SharePlan> m_tried; // plans that m_choice tries
    uint64_t m_tried_kind = 0;      // kind of the poses for which the plans were tried
    ServiceTime m_tried_at{0};
    BandBalance m_bands;
    Rates m_rates;
};

} // namespace gsc
