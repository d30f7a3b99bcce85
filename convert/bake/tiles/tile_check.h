// SPDX-License-Identifier: Apache-2.0
// Checks that files can be tiles of one model.
#pragma once

#include <gsc/gsc_reader.h>

#include <string>

namespace gsc {

// Throws Error(Difference) with the name of the field if parameters, networks or embedding rows differ, because then
// anchors would be drawn differently.
void checkSameModel(const GscView& first, const std::string& first_name, const GscView& other,
                    const std::string& other_name);

} // namespace gsc
