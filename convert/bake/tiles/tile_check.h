// SPDX-License-Identifier: Apache-2.0
// Whether files can be tiles of one model.
#pragma once

#include <gsc/gsc_reader.h>

#include <string>

namespace gsc {

// Requires that parameters, networks and rows of the embedding, which decide the picture of an anchor, are equal in
// both files. Throws Error(Difference) that names the first field that differs.
void checkSameModel(const GscView& first, const std::string& first_name, const GscView& other,
                    const std::string& other_name);

} // namespace gsc
