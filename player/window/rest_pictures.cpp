// SPDX-License-Identifier: Apache-2.0
#include "player/window/rest_pictures.h"

#include <algorithm>

namespace gsc {

bool RestPictures::goOn(const CoarseCounts& drawn, bool gave_up)
{
    m_pictures = std::min(m_pictures + 1, kMost);
    m_unmade = drawn.stale + drawn.made > 0 ? 0 : std::min(m_unmade + 1, kUnmade);
    const bool has_detail = drawn.near + drawn.kept + drawn.stale + drawn.made > 0;
    return (has_detail && m_unmade < kUnmade && m_pictures < kMost) || (gave_up && m_pictures < kGiveBack);
}

} // namespace gsc
