// SPDX-License-Identifier: Apache-2.0
#include "player/tool/version.h"

#include "format/error.h"
#include "format/gsc_layout.h"

namespace gsc {

std::string toolVersion()
{
    return GSC_VERSION;
}

std::string toolCommit()
{
    return GSC_COMMIT;
}

std::string versionWithCommit()
{
    return std::string(GSC_VERSION) + (*GSC_COMMIT != 0 ? ", commit " GSC_COMMIT : "");
}

std::string versionText(const std::string& program)
{
    return formatString("%s %s\nfile format %u.%u\nCUDA %s", program.c_str(), versionWithCommit().c_str(),
                        unsigned(kVersionMajor), unsigned(kVersionMinor), GSC_CUDA_TEXT);
}

} // namespace gsc
