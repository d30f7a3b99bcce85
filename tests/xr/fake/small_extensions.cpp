// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "system.h"

#include <cmath>

namespace gsc::fake_xr {

namespace {

constexpr int64_t kSecond = 1'000'000'000;

std::vector<float> offeredRates(const Settings& settings)
{
    std::set<float> rates{float(settings.hz)};
    for (const RateChange& change : settings.rate_changes)
        rates.insert(float(change.hz));
    return {rates.begin(), rates.end()};
}

} // namespace

XrResult xrGetVisibilityMaskKHR(XrSession session, XrViewConfigurationType type, uint32_t view,
                                XrVisibilityMaskTypeKHR mask_type, XrVisibilityMaskKHR* out)
{
    return guarded("xrGetVisibilityMaskKHR", [&](Runtime& rt) {
        rt.requireSession(session);
        const uint32_t views = requireConfiguration(rt, type);
        requireType(out, XR_TYPE_VISIBILITY_MASK_KHR, "visibilityMask");
        if (view >= views)
            refuse(XR_ERROR_VALIDATION_FAILURE, formatString("view %u of %u", view, views));
        const Masks& masks = *rt.settings.visibility_mask;
        const auto known = masks.find(view);
        const bool hidden = mask_type == XR_VISIBILITY_MASK_TYPE_HIDDEN_TRIANGLE_MESH_KHR;
        const MaskSettings mask = hidden && known != masks.end() ? known->second : MaskSettings{};
        const XrResult result =
            listOut(mask.vertices, out->vertexCapacityInput, &out->vertexCountOutput, out->vertices);
        if (out->vertexCapacityInput > 0 || out->indexCapacityInput > 0)
            rt.log.line(formatString(R"({"visibility_mask":%u,"hidden":%s,"vertices":%zu,"indices":%zu})", view,
                                     hidden ? "true" : "false", mask.vertices.size(), mask.indices.size()));
        return result == XR_SUCCESS
                   ? listOut(mask.indices, out->indexCapacityInput, &out->indexCountOutput, out->indices)
                   : result;
    });
}

// note: the virtual clock has no relation to the machine's: every time of that is its now
XrResult xrConvertTimespecTimeToTimeKHR(XrInstance instance, const timespec* time, XrTime* out)
{
    return guarded("xrConvertTimespecTimeToTimeKHR", [&](Runtime& rt) {
        rt.requireInstance(instance);
        requirePointer(time, "timespecTime");
        requirePointer(out, "time");
        *out = rt.settings.real_clock ? time->tv_sec * kSecond + time->tv_nsec : rt.now();
        return XR_SUCCESS;
    });
}

XrResult xrConvertTimeToTimespecTimeKHR(XrInstance instance, XrTime time, timespec* out)
{
    return guarded("xrConvertTimeToTimespecTimeKHR", [&](Runtime& rt) {
        rt.requireInstance(instance);
        requirePointer(out, "timespecTime");
        if (time <= 0)
            refuse(XR_ERROR_TIME_INVALID, "time is not more than 0");
        *out = {time / kSecond, time % kSecond};
        return XR_SUCCESS;
    });
}

XrResult xrEnumerateDisplayRefreshRatesFB(XrSession session, uint32_t capacity, uint32_t* count, float* out)
{
    return guarded("xrEnumerateDisplayRefreshRatesFB", [&](Runtime& rt) {
        rt.requireSession(session);
        return listOut(offeredRates(rt.settings), capacity, count, out);
    });
}

XrResult xrGetDisplayRefreshRateFB(XrSession session, float* out)
{
    return guarded("xrGetDisplayRefreshRateFB", [&](Runtime& rt) {
        rt.requireSession(session);
        requirePointer(out, "displayRefreshRate");
        *out = float(rt.refreshes.rate());
        return XR_SUCCESS;
    });
}

XrResult xrRequestDisplayRefreshRateFB(XrSession session, float hz)
{
    return guarded("xrRequestDisplayRefreshRateFB", [&](Runtime& rt) {
        rt.requireSession(session);
        if (hz == 0) // the runtime's choice
            return XR_SUCCESS;
        const std::vector<float> offered = offeredRates(rt.settings);
        if (std::find(offered.begin(), offered.end(), hz) == offered.end())
            refuse(XR_ERROR_DISPLAY_REFRESH_RATE_UNSUPPORTED_FB, formatString("%g Hz is not offered", double(hz)));
        rt.setRate(double(hz));
        return XR_SUCCESS;
    });
}

} // namespace gsc::fake_xr
