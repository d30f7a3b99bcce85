// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/policy/mode_choice.h"

#include <gsc/error.h>
#include "kernels/threads/stopwatch.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr uint32_t kRounds = 8;             // number of turns that each plan gets
constexpr uint32_t kSkipped = 1, kTurn = 2; // poses of a turn: kSkipped at its start are ignored, kTurn count
// a pose is not compared if the whole frames around it have times that differ by this factor
constexpr double kJump = 1.5;
constexpr double kDrift = 2;      // factor by which frame times must change before plans are tried again
constexpr uint32_t kSettled = 60; // number of poses after which the running mean counts as settled
constexpr double kLeastMs = 1e-3;

// Returns the median; infinity if there are no values, so that a plan without them is never the best.
double median(std::vector<double> values)
{
    if (values.empty())
        return INFINITY;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

std::string planText(const SharePlan& plan)
{
    return plan.workers == 1 ? std::string("one worker")
                             : formatString("%s with %u workers", serviceModeName(plan.mode), plan.workers);
}

} // namespace

const char* serviceModeName(ServiceMode mode)
{
    constexpr const char* kNames[] = {"auto", "frame", "eye", "split"};
    return kNames[uint32_t(mode)];
}

std::vector<SharePlan> ModeChoice::plansFor(uint32_t workers, uint32_t eyes, bool merged, bool fewer)
{
    if (workers < 2)
        return {{ServiceMode::Frame, 1}};
    std::vector<SharePlan> plans;
    if (fewer)
        plans.push_back({ServiceMode::Frame, 1});
    plans.push_back({ServiceMode::Frame, workers});
    if (eyes == 2 && !merged)
        plans.push_back({ServiceMode::Eye, 2});
    plans.push_back({ServiceMode::Split, workers});
    return plans;
}

void ModeChoice::begin(std::vector<SharePlan> plans)
{
    m_trials.clear();
    for (const SharePlan& plan : plans)
        m_trials.emplace_back().plan = plan;
    m_current = m_turn = 0;
    m_poses = 0;
    ++m_serial;
    m_decided = m_trials.size() == 1;
    m_cause = m_decided ? "there is one worker" : "";
    m_since = 0;
}

// Ends a turn and stores its poses. For workers that take turns, the time from frame to frame is measured over as many
// frames as there are workers.
void ModeChoice::Trial::endTurn(size_t first_number)
{
    for (size_t i = kSkipped; i < turn.size(); ++i) {
        const bool has = i >= turns();
        const ServiceTime span = has ? turn[i].at - turn[i - turns()].at : ServiceTime(0);
        const double ms = milliseconds(span) / turns();
        counted.push_back({first_number + i, turn[i], has ? ms : NAN});
    }
    turn.clear();
}

bool ModeChoice::add(uint64_t serial, const SharedPose& pose)
{
    if (serial != m_serial)
        return false;
    Trial& trial = m_trials[m_current];
    if (m_decided) {
        m_now_ms += (pose.busy_ms - m_now_ms) / std::min(m_since + 1.0, double(kSettled));
        ++m_since;
        return false;
    }
    trial.turn.push_back(pose);
    if (trial.turn.size() < kSkipped + kTurn + trial.turns() - 1)
        return false;
    const size_t length = trial.turn.size();
    trial.endTurn(m_poses);
    m_poses += length;
    ++m_turn;
    ++m_serial;
    // whole frames have the first turn, the last one, and one between any two turns of other plans
    const size_t others = m_trials.size() - 1;
    if (m_turn > 2 * others * kRounds)
        decide();
    else
        m_current = m_turn % 2 == 0 ? 0 : 1 + m_turn / 2 % others;
    return true;
}

// Milliseconds that one worker would have taken for all of pose `number`: interpolated between the whole frames drawn
// before and after it, two on each side. `jumps`: the times of those differ too much.
double ModeChoice::wholeMs(size_t number, bool& jumps) const
{
    const std::vector<Counted>& whole = m_trials.front().counted;
    const auto after = size_t(std::ranges::lower_bound(whole, number, {}, &Counted::number) - whole.begin());
    jumps = false;
    if (after < whole.size() && whole[after].number == number)
        return std::max(whole[after].pose.busy_ms, kLeastMs);
    const size_t first = std::clamp<size_t>(after, 2, whole.size() - 2) - 2;
    double curve = 0, least = INFINITY, most = kLeastMs;
    for (size_t i = first; i < first + 4; ++i) {
        double weight = 1; // weight in Lagrange's interpolation
        for (size_t j = first; j < first + 4; ++j)
            if (j != i)
                weight *=
                    (double(number) - double(whole[j].number)) / (double(whole[i].number) - double(whole[j].number));
        curve += weight * whole[i].pose.busy_ms;
        least = std::min(least, std::max(whole[i].pose.busy_ms, kLeastMs));
        most = std::max(most, whole[i].pose.busy_ms);
    }
    jumps = most > kJump * least;
    return std::clamp(curve, least / kJump, most * kJump);
}

// Computes the mean times of each plan: medians of the ratio to one worker's time for the same pose, times the mean of
// the latter.
void ModeChoice::compare()
{
    double sum = 0;
    for (const Counted& whole : m_trials.front().counted)
        sum += std::max(whole.pose.busy_ms, kLeastMs);
    const double mean = sum / double(m_trials.front().counted.size());
    for (Trial& trial : m_trials) {
        std::vector<double> ms, busy, interval, any_ms, any_busy, any_interval;
        for (const Counted& counted : trial.counted) {
            bool jumps = false;
            const double whole = wholeMs(counted.number, jumps);
            for (const bool any : {false, true}) {
                if (jumps && !any)
                    continue;
                (any ? any_ms : ms).push_back(counted.pose.ms / whole);
                (any ? any_busy : busy).push_back(counted.pose.busy_ms / whole);
                if (!std::isnan(counted.interval_ms))
                    (any ? any_interval : interval).push_back(counted.interval_ms / whole);
            }
        }
        // poses that jump count only if there are no others
        ms = ms.empty() ? any_ms : ms;
        busy = busy.empty() ? any_busy : busy;
        interval = interval.empty() ? any_interval : interval;
        trial.latency = mean * median(ms);
        trial.interval = mean * median(interval);
        trial.busy = mean * median(busy);
        trial.rate = 1000 / std::max(trial.busy / trial.turns(), kLeastMs);
    }
}

void ModeChoice::decide()
{
    compare();
    // plans that reach the wanted rate come before plans that do not
    const auto better = [&](const Trial& a, const Trial& b) {
        return a.holds(m_wanted) != b.holds(m_wanted) ? a.holds(m_wanted) : a.score(m_wanted) < b.score(m_wanted);
    };
    const auto best = std::ranges::min_element(m_trials, better);
    const Trial& one = m_trials.front(); // the plan of one worker, if it is tried: plansFor() puts it first
    const double least = best->score(m_wanted);
    const bool as_good = one.plan.workers == 1 && one.holds(m_wanted) == best->holds(m_wanted) &&
                         one.score(m_wanted) <= least + std::max(kAsGoodShare * least, kAsGoodMs);
    m_current = as_good ? 0 : size_t(best - m_trials.begin());
    m_decided = true;
    m_cause.clear();
    for (const Trial& trial : m_trials)
        m_cause += (m_cause.empty() ? "" : ", ") + planText(trial.plan) +
                   formatString(" %.2f ms and %.1f fps", trial.latency,
                                m_wanted > 0 ? trial.rate : 1000 / std::max(trial.interval, kLeastMs));
    if (as_good)
        m_cause += "; one worker is as fast";
    m_since = 0;
    m_now_ms = 0;
}

double ModeChoice::bestRate() const
{
    double best = 0;
    for (const Trial& trial : m_trials) {
        std::vector<double> busy;
        for (const Counted& counted : trial.counted)
            busy.push_back(counted.pose.busy_ms);
        if (!busy.empty())
            best = std::max(best, 1000 * trial.turns() / std::max(median(busy), kLeastMs));
    }
    return best;
}

bool ModeChoice::drifted() const
{
    // compares busy times, which do not depend on the number of frames in flight
    const double tried = m_trials[m_current].busy;
    return m_decided && m_trials.size() > 1 && m_since >= kSettled &&
           (m_now_ms > kDrift * tried || m_now_ms * kDrift < tried);
}

} // namespace gsc
