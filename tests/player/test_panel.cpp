// SPDX-License-Identifier: Apache-2.0
#include "player/window/panel.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;

TEST_CASE("panel: what passes at rest is no time of a frame, and long groups are folded at first")
{
    Overlay overlay;
    Panel panel({}, {"first"}, overlay);
    const auto item = [&](const char* label) -> const OverlayItem& {
        return *std::ranges::find(overlay.items, label, &OverlayItem::label);
    };
    panel.addRefresh(16, false);
    CHECK(item("refresh, ms").text.empty());
    panel.addRefresh(3800, true);
    CHECK(item("refresh, ms").text == "at rest");
    CHECK(item("refresh, ms").history == std::vector<float>{16});
    panel.addRefresh(17, false);
    CHECK(item("refresh, ms").text.empty());
    CHECK(item("refresh, ms").history == std::vector<float>{16, 17});
    for (const char* const open : {"Camera", "Picture", "Time"})
        CHECK(item(open).on);
    for (const char* const folded : {"Stages", "Counts per eye", "Machine"})
        CHECK_FALSE(item(folded).on);
}
