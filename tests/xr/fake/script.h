// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "settings.h"

namespace gsc::fake_xr {

constexpr XrPosef kIdentity{{0, 0, 0, 1}, {0, 0, 0}};

XrQuaternionf normalized(XrQuaternionf q);
bool isUnit(const XrQuaternionf& q);                   // within the 1 % that OpenXR allows
XrPosef operator*(const XrPosef& a, const XrPosef& b); // b, given in a's axes
XrPosef inverse(const XrPosef& pose);

// Poses and inputs at t seconds of the script.
XrPosef headAt(const Settings& settings, double t);
XrPosef poseAt(const std::vector<PoseKey>& keys, double t); // keys: by t, at least one, on the short way
bool trackedAt(const Settings& settings, double t);
float inputAt(const Settings& settings, const std::string& path, double t); // 0 before its first key

} // namespace gsc::fake_xr
