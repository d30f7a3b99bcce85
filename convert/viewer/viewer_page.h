// SPDX-License-Identifier: Apache-2.0
// A page that shows a model of Gaussians to whoever has nothing but a browser with WebGL2.
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <span>
#include <string>

namespace gsc {

// One HTML file that needs nothing else. Same input, same bytes. `sog`: a SOG file. `model`, of which page/viewer.js reads:
//   name, version, at           texts; `at` is the camera whose view the model is, or null
//   gaussians                   as in schemas/export-report.schema.json
//   bytes                       of the SOG file
//   background                  red, green, blue, 0 to 1
//   cameras, first              {name, position, rotation, width, height, fov_x, fov_y} as in a trajectory file; at least one, and the
//                               number of the one that is shown first
std::string viewerPage(const nlohmann::ordered_json& model, std::span<const std::byte> sog);

} // namespace gsc
