// SPDX-License-Identifier: Apache-2.0
// Check that files can be tiles of one model.
#pragma once

#include <gsc/gsc_reader.h>

#include <string>

namespace gsc {

// Throws Error(Difference), naming the field, where parameters, networks or embedding rows differ: they decide the picture
// of an anchor.
void checkSameModel(const GscView& first, const std::string& first_name, const GscView& other,
                    const std::string& other_name);

} // namespace gsc
