// SPDX-License-Identifier: Apache-2.0
// Rates a place by the anchors in view from it and the free space round it.
#include "convert/sample/paths/path_places.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

// metres; anchors closer to the eye than this count against a place
constexpr double kBodyRadius = 0.5;
// metres; anchors closer than this in the middle of the view hide the others
constexpr double kCloseMetres = 2;

} // namespace

double PathPlaces::familiarity(const Place& place) const
{
    if (m_familiar.empty())
        return 1;
    double sum = 0;
    size_t count = 0;
    for (const Seen& seen : m_familiar) {
        const dvec3 d = seen.position - place.position;
        if (const double depth = dot(d, place.forward); depth <= m_survey.near_z || depth < 0.6 * length(d))
            continue;
        const dvec3 ray = normalized(d);
        double nearest = -1;
        for (const dvec3& other : seen.rays)
            nearest = std::max(nearest, dot(ray, other));
        sum += std::clamp((nearest - 0.5) / 0.45, 0.0, 1.0);
        ++count;
    }
    return count ? sum / double(count) : 0;
}

PathPlaces::Sight PathPlaces::sight(const Place& place) const
{
    const double tan_x = std::tan(0.5 * m_lens.fov_x), tan_y = tan_x * m_lens.height / m_lens.width;
    const dvec3 right = normalized(cross(place.forward, m_survey.site.up)), down = cross(place.forward, right);
    const double close = kCloseMetres * m_survey.site.metre;
    size_t count = 0;
    Sight sight;
    for (const dvec3& p : m_sample) {
        const dvec3 d = p - place.position;
        const double depth = dot(d, place.forward), x = std::abs(dot(d, right)), y = std::abs(dot(d, down));
        if (depth <= m_survey.near_z || x > depth * tan_x || y > depth * tan_y)
            continue;
        ++count;
        sight.close += depth < close && x < 0.5 * depth && y < 0.5 * depth;
    }
    sight.share = double(count) / double(m_sample.size());
    return sight;
}

double PathPlaces::share(const Place& place) const
{
    return sight(place).share;
}

size_t PathPlaces::crowd(dvec3 position, double radius) const
{
    size_t count = 0;
    for (const dvec3& p : m_sample)
        count += dot(p - position, p - position) < radius * radius;
    return count;
}

double PathPlaces::worth(const Place& place) const
{
    const double radius = std::max(kBodyRadius * m_survey.site.metre, m_survey.near_z);
    const Sight seen = sight(place);
    return seen.share * (0.02 + familiarity(place)) /
           (1 + 0.5 * double(crowd(place.position, radius)) + 0.1 * double(seen.close));
}

// How free a place is: 1 where photographs were taken, less with the distance from the nearest camera.
double PathPlaces::freedom(dvec3 eye) const
{
    const bool high = m_survey.kind == CaptureKind::Aerial;
    const double reach = high ? 0.5 * m_survey.viewing_distance : m_survey.site.metre;
    double nearest = m_standing.empty() ? 0 : 1e300;
    for (const Place& place : m_standing)
        nearest = std::min(nearest, length(place.position - eye));
    return 1 / (1 + nearest * nearest / (reach * reach));
}

dvec3 PathPlaces::level(dvec3 direction) const
{
    const dvec3 flat = direction - m_survey.site.up * dot(direction, m_survey.site.up);
    return length(flat) > 1e-6 ? normalized(flat) : m_survey.site.axis[0];
}

// Height below which most anchors above or below a place lie; the height of the site's ground if there are too few.
double PathPlaces::groundNear(dvec3 position) const
{
    const PathSite& site = m_survey.site;
    std::vector<double> heights;
    const double radius = 1.5 * site.metre;
    for (const dvec3& p : m_sample) {
        const dvec3 d = p - position, flat = d - site.up * dot(d, site.up);
        if (dot(flat, flat) < radius * radius)
            heights.push_back(dot(p, site.up));
    }
    return heights.size() < 3 ? site.ground : quantile(heights, 0.8);
}

PathSite PathPlaces::flightSite(double from, double to, double& height) const
{
    PathSite site = m_survey.site;
    const double side = site.high[1] - site.low[1];
    for (const double part : {0.5, 0.75, 1.0})
        for (const double aside : {0.0, -0.2, 0.2}) {
            site.low[1] = m_survey.site.low[1] + aside * side;
            site.high[1] = m_survey.site.high[1] + aside * side;
            height = part * site.view_height;
            size_t hit = 0;
            for (int i = 0; i <= 24; ++i) {
                const double t = lerp(from, to, i / 24.0);
                hit += crowd(site.axis[0] * lerp(site.low[0], site.high[0], t) +
                                 site.axis[1] * lerp(site.low[1], site.high[1], t) + site.up * (site.ground + height),
                             2 * site.metre);
            }
            if (hit == 0)
                return site;
        }
    return m_survey.site;
}

} // namespace gsc
