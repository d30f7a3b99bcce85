// SPDX-License-Identifier: Apache-2.0
// A pose by itself: where its pictures lie, what became of its parts, whether it shows what another does.
#include "runtime/service/service_core.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gsc {

namespace {

// Whether an eye is so near to another that it shows the same. Two rotations by an angle from each other differ by
// sqrt(8) sin(angle / 2), which stays exact where the angle is small.
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
           a.view == b.view && a.foveation == b.foveation && std::ranges::equal(a.lens, b.lens) &&
           r.policy == s.policy && r.max_depth == s.max_depth && r.guidance == s.guidance && r.bound == s.bound &&
           r.decode_budget == s.decode_budget && r.cache_bytes == s.cache_bytes;
}

} // namespace

void PoseWork::layOut()
{
    constexpr size_t kAlign = 256;
    const auto place = [this](size_t size) {
        const size_t at = bytes;
        bytes += (size + kAlign - 1) / kAlign * kAlign;
        return at;
    };
    bytes = 0;
    for (uint32_t e = 0; e < eye_count; ++e) {
        const size_t pixels = size_t(eyes[e].width) * eyes[e].height;
        pixels_at[e] = place(pixels * pixelBytes(format));
        if (wants_depth)
            depths_at[e] = place(pixels * sizeof(float));
    }
}

// `eyes` stay as they were submitted: others read them with the mutex held.
std::span<const EyeParams> PoseWork::latestEyes() const
{
    const std::span<const EyeParams> asked(eyes, eye_count);
    if (late == nullptr)
        return asked;
    std::call_once(late->looked, [&] {
        std::ranges::copy(asked, late->eyes);
        late->found = late->look({late->eyes, eye_count});
        for (uint32_t e = 0; e < eye_count; ++e) // memory was laid out for pictures of their size
            late->found = late->found && late->eyes[e].width == eyes[e].width && late->eyes[e].height == eyes[e].height;
    });
    return late->found ? std::span<const EyeParams>(late->eyes, eye_count) : asked;
}

FrameTarget PoseWork::target(uint32_t eye, FrameTarget::Kind kind, std::byte* block) const
{
    FrameTarget to;
    to.kind = kind;
    to.format = format;
    to.pixels = block + pixels_at[eye];
    if (wants_depth)
        to.depth = reinterpret_cast<float*>(block + depths_at[eye]);
    return to;
}

FrameResult PoseWork::result() const
{
    FrameResult all;
    all.passes = 0;
    double longest = -1;
    for (const PoseWork::Part& part : parts) {
        const FrameResult& own = part.result;
        uint32_t at = 0;
        for (uint32_t e = 0; e < eye_count; ++e)
            if (part.what.eyes >> e & 1)
                all.eyes[e].add(own.eyes[at++]);
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

bool PoseWork::showsSameAs(const PoseWork& other, double distance, double degrees) const
{
    if (other.eye_count != eye_count || other.format != format || other.wants_depth != wants_depth ||
        other.on_device != on_device || !sameOptions(other.options, options))
        return false;
    for (uint32_t e = 0; e < eye_count; ++e)
        if (!isNear(other.eyes[e], eyes[e], distance, degrees))
            return false;
    return true;
}

} // namespace gsc
