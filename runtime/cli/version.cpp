// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/version.h"

#include <gsc/error.h>
#include <gsc/gsc_layout.h>

namespace gsc {

std::string toolVersion()
{
    return GSC_VERSION;
}

std::string toolCommit()
{
    return GSC_COMMIT;
}

std::string versionText(const std::string& program)
{
    const std::string commit = toolCommit().empty() ? "" : ", commit " + toolCommit();
    return formatString("%s %s%s\nfile format %u.%u\nCUDA %s", program.c_str(), GSC_VERSION, commit.c_str(),
                        unsigned(kVersionMajor), unsigned(kVersionMinor), GSC_CUDA_TEXT);
}

} // namespace gsc
