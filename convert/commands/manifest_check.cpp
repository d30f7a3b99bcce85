// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/manifest_check.h"

#include <gsc/error.h>
#include <gsc/gsc_issues.h>

#include <nlohmann/json.hpp>

namespace gsc {

void checkManifest(const GscView& view, const IssueSink& sink)
{
    if (nlohmann::json::accept(view.manifest))
        return;
    uint64_t offset = 0;
    for (const SectionEntry& entry : view.sections)
        if (entry.type == kSectionMeta)
            offset = entry.offset;
    const IssueInfo& info = issueInfo(issue::ManifestJson);
    sink({&info, offset, "/sections/META",
          formatString(info.detail, "a JSON parser does not accept it, expected one object; convert the model again")});
}

} // namespace gsc
