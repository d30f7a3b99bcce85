// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/policy/pace.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

PaceDecision Pace::look(ServiceTime now, const PaceFacts& facts)
{
    if (facts.working == 0) { // no worker draws, so there is no rate
        m_low = m_high = std::nullopt;
        return facts.ready > 0 ? PaceDecision{PaceStep::Start, "no worker draws"} : PaceDecision{};
    }
    const bool unknown = facts.rate <= 0 && facts.predicted_rate <= 0;
    if (unknown || facts.starting > 0) {
        // forgets since when the rate was too low or too high, because the rate has changed or is unknown
        m_low = m_high = std::nullopt;
        if (facts.starting > 0)
            m_stepped = now;
    }
    if (!m_rules.elastic() || unknown || facts.starting > 0)
        return {};
    const bool known = facts.rate > 0, foreseen = facts.predicted_rate > 0;
    const double worst = !known      ? facts.predicted_rate
                         : !foreseen ? facts.rate
                                     : std::min(facts.rate, facts.predicted_rate);
    // the remaining workers alone must still exceed max_fps, so that a stop never causes a start
    const uint32_t remain = facts.working - 1;
    const double most = remain > 0 ? (1 + 1.0 / remain) * m_rules.max_fps : 0;
    const auto follow = [now](std::optional<ServiceTime>& since, bool holds) {
        if (!holds)
            since.reset();
        else if (!since)
            since = now;
    };
    follow(m_low, m_rules.min_fps > 0 && worst < m_rules.min_fps);
    follow(m_high, m_rules.max_fps > 0 && remain > 0 && worst > most);
    if (m_stepped && now - *m_stepped < m_rules.settle)
        return {};
    if (m_low && now - *m_low >= m_rules.start_after && facts.ready > 0) {
        m_stepped = now;
        m_low.reset();
        const bool ahead = known && facts.rate >= m_rules.min_fps;
        return {PaceStep::Start,
                formatString("%s %.1f fps, below %g", ahead ? "predicted rate" : "rate", worst, m_rules.min_fps)};
    }
    if (m_high && now - *m_high >= m_rules.stop_after) {
        m_stepped = now;
        m_high.reset();
        return {PaceStep::Stop, formatString("rate %.1f fps, above (1 + 1/%u) of %g", worst, remain, m_rules.max_fps)};
    }
    return {};
}

} // namespace gsc
