// SPDX-License-Identifier: Apache-2.0
// A single pose of a service: layout of the pictures, results of the parts, and comparison with another pose.
#include "runtime/service/pose_work.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gsc {

namespace {

// Returns true if two eyes are so near to each other that they show the same. The matrices of two rotations by an
// angle from each other differ by sqrt(8) sin(angle / 2), a formula that is exact for small angles.
bool isNear(const EyeParams& a, const EyeParams& b, double distance, double degrees)
{
    double moved = 0, turned = 0;
    const auto square = [](double x) { return x * x; };
    for (int i = 0; i < 3; ++i) {
        moved += square(double(a.center[i]) - b.center[i]);
        for (int j = 0; j < 3; ++j)
            turned += square(double(a.world_to_view[4 * i + j]) - b.world_to_view[4 * i + j]);
    }
    const double most = std::sqrt(8.0) * std::sin(std::min(degrees, 180.0) * std::numbers::pi / 360);
    return std::sqrt(moved) <= distance && std::sqrt(turned) <= most && a.tan_fov_x == b.tan_fov_x &&
           a.tan_fov_y == b.tan_fov_y && a.tan_mid_x == b.tan_mid_x && a.tan_mid_y == b.tan_mid_y &&
           a.width == b.width && a.height == b.height;
}

bool sameOptions(const FrameOptions& a, const FrameOptions& b)
{
    const ReuseOptions &r = a.reuse, &s = b.reuse;
    return a.tier == b.tier && a.stereo == b.stereo && std::ranges::equal(a.background, b.background) &&
           a.appearance == b.appearance && a.near_z == b.near_z && a.empty_is_black == b.empty_is_black &&
           a.lod_bias == b.lod_bias && a.lod_fade == b.lod_fade && a.lod_hysteresis == b.lod_hysteresis &&
           a.view == b.view && a.foveation == b.foveation && a.detail == b.detail &&
           std::ranges::equal(a.lens, b.lens) && r.policy == s.policy && r.max_depth == s.max_depth &&
           r.guidance == s.guidance && r.bound == s.bound && r.decode_budget == s.decode_budget &&
           r.cache_bytes == s.cache_bytes;
}

} // namespace

PoseWork::PoseWork(const PoseRequest& request) : asked(request)
{
    if (asked.late)
        late = std::make_shared<Late>();
    constexpr size_t kAlign = 256;
    const auto place = [this](size_t size) {
        const size_t at = bytes;
        bytes += (size + kAlign - 1) / kAlign * kAlign;
        return at;
    };
    for (uint32_t e = 0; e < eyeCount(); ++e) {
        const size_t pixels = size_t(asked.eyes[e].width) * asked.eyes[e].height;
        pixels_at[e] = place(pixels * pixelBytes(asked.format));
        if (asked.wants_depth)
            depths_at[e] = place(pixels * sizeof(float));
    }
}

std::shared_ptr<PoseWork> PoseWork::again() const
{
    auto fresh = std::make_shared<PoseWork>(*this);
    fresh->memory = nullptr;
    fresh->pictures = nullptr;
    fresh->drawn_anew = true;
    for (Part& part : fresh->parts)
        part = {part.what};
    return fresh;
}

void PoseWork::setParts(const std::vector<PosePart>& cut)
{
    parts.clear();
    for (const PosePart& part : cut)
        parts.push_back({part});
}

bool PoseWork::isCut() const
{
    return std::ranges::any_of(parts, [](const Part& part) { return !part.what.columns.all(); });
}

std::span<const EyeParams> PoseWork::latestEyes() const
{
    if (late == nullptr)
        return asked.eyes;
    std::call_once(late->looked, [&] {
        late->eyes = asked.eyes;
        late->found =
            asked.late(late->eyes) &&
            std::ranges::equal(late->eyes, asked.eyes, [](const EyeParams& a, const EyeParams& b) {
                return a.width == b.width && a.height == b.height; // the memory was laid out for pictures of this size
            });
    });
    return late->found ? late->eyes : asked.eyes;
}

FrameTarget PoseWork::target(uint32_t eye, FrameTarget::Kind kind, std::byte* block) const
{
    FrameTarget to;
    to.kind = kind;
    to.format = asked.format;
    to.pixels = block + pixels_at[eye];
    if (asked.wants_depth)
        to.depth = reinterpret_cast<float*>(block + depths_at[eye]);
    return to;
}

FrameResult PoseWork::result() const
{
    FrameResult all;
    all.passes = 0;
    double longest = -1;
    for (const Part& part : parts) {
        const FrameResult& own = part.result;
        uint32_t at = 0;
        for (uint32_t e = 0; e < eyeCount(); ++e)
            if (part.what.eyes >> e & 1)
                all.eyes[e].add(own.eyes[at++]);
        all.coarse.add(own.coarse);
        if (own.times.total > longest) {
            longest = own.times.total;
            all.times = own.times;
        }
        all.bytes_resident = std::max(all.bytes_resident, own.bytes_resident);
        all.repeats += own.repeats;
        all.repeat_ms = std::max(all.repeat_ms, own.repeat_ms);
        all.cache_bytes = std::max(all.cache_bytes, own.cache_bytes);
        all.cache_evictions += own.cache_evictions;
        all.passes = std::max(all.passes, own.passes);
        all.anchors_absent = std::max(all.anchors_absent, own.anchors_absent);
    }
    return all;
}

FrameLoad PoseWork::load() const
{
    FrameLoad all;
    for (const Part& part : parts) {
        const FrameLoad own = loadOf(part.result);
        all = {all.anchors + own.anchors, all.pairs + own.pairs, all.evaluations + own.evaluations};
    }
    return all;
}

bool PoseWork::showsSameAs(const PoseWork& other, double distance, double degrees) const
{
    const auto near = [&](const EyeParams& a, const EyeParams& b) { return isNear(a, b, distance, degrees); };
    const PoseRequest& a = other.asked;
    return a.format == asked.format && a.wants_depth == asked.wants_depth && a.on_device == asked.on_device &&
           sameOptions(a.options, asked.options) && std::ranges::equal(a.eyes, asked.eyes, near);
}

} // namespace gsc
