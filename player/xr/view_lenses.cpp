// SPDX-License-Identifier: Apache-2.0
#include "player/xr/view_lenses.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

ViewLenses::ViewLenses(Headset& headset, Reporter& log)
    : m_headset(headset), m_log(log), m_views(headset.facts().views.size())
{
    (void)headset.hiddenChanged(); // clears the flag of changed meshes, because all meshes are read below
}

void ViewLenses::follow(const std::vector<SpaceEye>& eyes)
{
    if (m_headset.hiddenChanged())
        for (View& view : m_views)
            view.known = false;
    for (size_t i = 0; i < std::min(eyes.size(), m_views.size()); ++i) {
        View& view = m_views[i];
        if (view.known && sameLens(view.eye, eyes[i]))
            continue;
        const HiddenMesh& mesh = m_headset.hidden(i);
        const std::string fault = meshFault(mesh);
        if (!fault.empty() && fault != view.fault)
            m_log.warning(
                formatString("headset: the mask of view %zu %s; its pictures are drawn whole", i, fault.c_str()));
        const HeadsetView& size = m_headset.facts().views[i];
        view = {true, eyes[i], lensShape(mesh, eyes[i], size.width, size.height), fault};
    }
}

void ViewLenses::tell(HeadsetFacts& facts) const
{
    for (size_t i = 0; i < m_views.size(); ++i)
        if (m_views[i].known)
            facts.views[i].hidden = hiddenShare(m_views[i].shape, facts.views[i].width, facts.views[i].height);
}

} // namespace gsc
