// SPDX-License-Identifier: Apache-2.0
// The files of page/ and PlayCanvas, which lie in the program.
#pragma once

#include <string_view>

namespace gsc {

std::string_view viewerTemplate(); // page/viewer.html, with the marks of viewer_page.cpp
std::string_view viewerStyle();
std::string_view viewerScript();
std::string_view playcanvasScript();
std::string_view playcanvasLicence();

} // namespace gsc
