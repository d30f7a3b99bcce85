// SPDX-License-Identifier: Apache-2.0
#include "actions.h"

#include <algorithm>

namespace gsc::fake_xr {

namespace {

constexpr const char* kLeft = "/user/hand/left";
constexpr const char* kRight = "/user/hand/right";

// Paths below a user path. Those of both hands first, then the ones that only one has.
struct Profile {
    const char* name;
    std::vector<std::string> both, left, right;
};

// OpenXR 1.0, chapter 6.4 (Interaction Profile Paths).
const std::vector<Profile>& profiles()
{
    static const std::vector<Profile> kProfiles{
        {"/interaction_profiles/khr/simple_controller",
         {"input/select/click", "input/menu/click", "input/grip/pose", "input/aim/pose", "output/haptic"},
         {},
         {}},
        {"/interaction_profiles/oculus/touch_controller",
         {"input/squeeze/value", "input/trigger/value", "input/trigger/touch", "input/thumbstick", "input/thumbstick/x",
          "input/thumbstick/y", "input/thumbstick/click", "input/thumbstick/touch", "input/thumbrest/touch",
          "input/grip/pose", "input/aim/pose", "output/haptic"},
         {"input/x/click", "input/x/touch", "input/y/click", "input/y/touch", "input/menu/click"},
         {"input/a/click", "input/a/touch", "input/b/click", "input/b/touch", "input/system/click"}},
        {"/interaction_profiles/htc/vive_controller",
         {"input/system/click", "input/squeeze/click", "input/menu/click", "input/trigger/click", "input/trigger/value",
          "input/trackpad", "input/trackpad/x", "input/trackpad/y", "input/trackpad/click", "input/trackpad/touch",
          "input/grip/pose", "input/aim/pose", "output/haptic"},
         {},
         {}},
        {"/interaction_profiles/microsoft/motion_controller",
         {"input/menu/click", "input/squeeze/click", "input/trigger/value", "input/thumbstick", "input/thumbstick/x",
          "input/thumbstick/y", "input/thumbstick/click", "input/trackpad", "input/trackpad/x", "input/trackpad/y",
          "input/trackpad/click", "input/trackpad/touch", "input/grip/pose", "input/aim/pose", "output/haptic"},
         {},
         {}},
        {"/interaction_profiles/valve/index_controller",
         {"input/system/click",   "input/system/touch",  "input/a/click",          "input/a/touch",
          "input/b/click",        "input/b/touch",       "input/squeeze/value",    "input/squeeze/force",
          "input/trigger/click",  "input/trigger/value", "input/trigger/touch",    "input/thumbstick",
          "input/thumbstick/x",   "input/thumbstick/y",  "input/thumbstick/click", "input/thumbstick/touch",
          "input/trackpad",       "input/trackpad/x",    "input/trackpad/y",       "input/trackpad/force",
          "input/trackpad/touch", "input/grip/pose",     "input/aim/pose",         "output/haptic"},
         {},
         {}},
        {"/interaction_profiles/ext/eye_gaze_interaction", {}, {}, {}}};
    return kProfiles;
}

const Profile* find(const std::string& name)
{
    const auto found = std::ranges::find(profiles(), name, &Profile::name);
    return found == profiles().end() ? nullptr : &*found;
}

// note: a path without its component stands for it, such as .../trigger for .../trigger/value
bool contains(const std::vector<std::string>& paths, const std::string& path)
{
    return std::ranges::any_of(paths, [&](const std::string& p) { return p == path || p.starts_with(path + "/"); });
}

} // namespace

bool profileKnown(const std::string& profile)
{
    return find(profile) != nullptr;
}

bool profileHas(const std::string& name, const std::string& path)
{
    if (name == "/interaction_profiles/ext/eye_gaze_interaction")
        return path == "/user/eyes_ext/input/gaze_ext/pose" || path == "/user/eyes_ext/input/gaze_ext";
    const Profile* profile = find(name);
    const std::string user = userPathOf(path);
    if (profile == nullptr || (user != kLeft && user != kRight) || path.size() == user.size())
        return false;
    const std::string below = path.substr(user.size() + 1);
    return contains(profile->both, below) || contains(user == kLeft ? profile->left : profile->right, below);
}

std::string userPathOf(const std::string& path)
{
    for (const char* user : {kLeft, kRight, "/user/eyes_ext", "/user/head", "/user/gamepad", "/user/treadmill"})
        if (path == user || path.starts_with(std::string(user) + "/"))
            return user;
    return {};
}

} // namespace gsc::fake_xr
