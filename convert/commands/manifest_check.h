// SPDX-License-Identifier: Apache-2.0
// Checks that META is JSON. format/ has no parser, so this part of the validation lives here.
#pragma once

#include <gsc/gsc_reader.h>

namespace gsc {

// Reports issue ManifestJson (3002). Precondition: `view` came from openGsc() without errors.
void checkManifest(const GscView& view, const IssueSink& sink);

} // namespace gsc
