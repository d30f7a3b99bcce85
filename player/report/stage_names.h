// SPDX-License-Identifier: Apache-2.0
// The stages of a frame as reports name them, in order.
#pragma once

#include "kernels/frame/frame_types.h"

namespace gsc {

inline constexpr struct {
    const char* name;
    double StageTimes::*field;
} kStages[] = {
    {"select", &StageTimes::select}, {"decode", &StageTimes::decode}, {"project", &StageTimes::project},
    {"bin", &StageTimes::bin},       {"sort", &StageTimes::sort},     {"blend", &StageTimes::blend},
};

} // namespace gsc
