// SPDX-License-Identifier: Apache-2.0
// Whether files can be tiles of one model.
#pragma once

#include <gsc/gsc_reader.h>

#include <string>

namespace gsc {

// What decides the picture of an anchor is the same in both: parameters, networks, rows of the embedding. Throws
// Error(Difference) that names the first field that is not.
void checkSameModel(const GscView& first, const std::string& first_name, const GscView& other,
                    const std::string& other_name);

} // namespace gsc
