// SPDX-License-Identifier: Apache-2.0
// Checks that the manifest (section META) is JSON. It lies here because format/ has no JSON parser.
#pragma once

#include <gsc/gsc_reader.h>

namespace gsc {

// Reports issue ManifestJson (3002) to `sink` if it is not. Precondition: `view` came from openGsc() without errors.
void checkManifest(const GscView& view, const IssueSink& sink);

} // namespace gsc
