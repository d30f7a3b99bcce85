// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "openxr_headers.h"

#include <map>
#include <set>
#include <string>
#include <vector>

namespace gsc::fake_xr {

struct Runtime;

struct ActionState {
    bool active = false, changed = false;
    XrVector2f value{0, 0}; // booleans and floats are its x
    XrTime last_change = 0;
};

struct Action {
    uint64_t set;
    XrActionType type;
    std::string name;
    std::vector<std::string> subactions;       // user paths
    std::map<std::string, ActionState> states; // by user path as of the last xrSyncActions, "" = any
};

struct ActionSet {
    std::string name;
    bool attached = false; // to a session, ever: it cannot change any more
};

struct Binding {
    uint64_t action;
    std::string path;
};

struct Actions {
    std::map<uint64_t, ActionSet> sets;
    std::map<uint64_t, Action> actions;
    std::map<std::string, std::vector<Binding>> suggested; // by interaction profile
    std::set<uint64_t> attached;                           // sets of the current session
    bool profile_announced = false;
};

// Interaction profiles as OpenXR defines them.
bool profileKnown(const std::string& profile);
bool profileHas(const std::string& profile, const std::string& path); // the path with or without its component
std::string userPathOf(const std::string& path);                      // "" if it has none

// Devices, profiles and paths in force, by the settings' controllers and the application's suggestions.
bool deviceActive(const Runtime& rt, const std::string& user_path);
std::string currentProfile(const Runtime& rt, const std::string& user_path); // "" = none
std::vector<std::string> boundPaths(const Runtime& rt, uint64_t action, const std::string& user_path);
// The pose of an action's space in LOCAL; false if it has none now.
bool locateAction(Runtime& rt, uint64_t action, const std::string& user_path, XrTime time, XrPosef& pose);

} // namespace gsc::fake_xr
