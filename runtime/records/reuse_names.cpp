// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/reuse_names.h"

namespace gsc {

namespace {

template <typename Value>
const char* nameIn(const std::vector<std::pair<std::string, Value>>& names, Value value)
{
    for (const auto& [name, entry] : names)
        if (entry == value)
            return name.c_str();
    return "unknown";
}

} // namespace

const std::vector<std::pair<std::string, ReusePolicy>>& reusePolicies()
{
    static const std::vector<std::pair<std::string, ReusePolicy>> names = {
        {"none", ReusePolicy::None}, {"depth", ReusePolicy::Depth}, {"error", ReusePolicy::Error}};
    return names;
}

const std::vector<std::pair<std::string, DepthGuidance>>& depthGuidances()
{
    static const std::vector<std::pair<std::string, DepthGuidance>> names = {
        {"linear", DepthGuidance::Linear},
        {"exponential", DepthGuidance::Exponential},
        {"staged", DepthGuidance::Staged}};
    return names;
}

const std::vector<std::pair<std::string, Tier>>& tiers()
{
    static const std::vector<std::pair<std::string, Tier>> names = {{"exact", Tier::Exact}, {"fast", Tier::Fast}};
    return names;
}

const std::vector<std::pair<std::string, TierChoice>>& tierChoices()
{
    static const std::vector<std::pair<std::string, TierChoice>> names = {
        {"exact", {Tier::Exact, 0}}, {"fast", {Tier::Fast, 0}}, {"turbo", {Tier::Fast, kTurboDetail}}};
    return names;
}

const std::vector<std::pair<std::string, StereoMode>>& stereoModes()
{
    static const std::vector<std::pair<std::string, StereoMode>> names = {{"exact", StereoMode::Exact},
                                                                          {"merged", StereoMode::Merged}};
    return names;
}

const char* policyName(ReusePolicy policy)
{
    return nameIn(reusePolicies(), policy);
}

const char* guidanceName(DepthGuidance guidance)
{
    return nameIn(depthGuidances(), guidance);
}

const char* stereoName(StereoMode stereo)
{
    return nameIn(stereoModes(), stereo);
}

} // namespace gsc
