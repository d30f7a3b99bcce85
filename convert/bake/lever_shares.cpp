// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/bake.h"

#include <bit>
#include <cmath>

namespace gsc {

std::vector<int64_t> leverShares(const BakeReport& report)
{
    std::vector<int64_t> shares(kLevers, 0);
    const StoredBytes &before = report.before.archive, &after = report.after.archive;
    const double stay = 1 - double(report.anchors_left_out) / double(report.anchors);
    // an anchor that is left out saves its part of every array, at the average bytes of an anchor in the source
    const double offsets = stay * double(before.offsets);
    const double kept_slots = stay * double(report.slots);
    const double masked = kept_slots > 0 ? offsets * double(report.slots_masked) / kept_slots : 0;
    const auto set = [&](Lever lever, double bytes) {
        shares[size_t(std::countr_zero(uint32_t(lever)))] += int64_t(std::llround(bytes));
    };
    // bytes saved by coarser steps: of kLeverCompact alone, they count for it; of both levers, for `lever`
    const auto steps = [&](Lever lever) {
        return (report.levers & kLeverCompact) && !(report.levers & lever) ? kLeverCompact : lever;
    };
    set(kLeverAnchors, (1 - stay) * double(before.anchors()));
    set(kLeverSlots, masked);
    set(steps(kLeverOffsets), offsets - masked - double(after.offsets));
    set(steps(kLeverFeatures), stay * double(before.features) - double(after.features));
    set(kLeverScales, stay * double(before.scales) - double(after.scales));
    set(kLeverOrder, stay * double(before.positions) - double(after.positions));
    set(kLeverNetworks, double(before.networks) - double(after.networks));
    return shares;
}

} // namespace gsc
