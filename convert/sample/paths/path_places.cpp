// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/path_places.h"

#include "convert/sample/paths/site_paths.h"
#include <gsc/interrupt.h>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

// most anchors that are counted to rate a place, so that a search takes about a second
constexpr size_t kScorePoints = 12'000;
constexpr size_t kFamiliarPoints = 400;
constexpr size_t kMostPlaces = 48;
// Number, and share, of the anchors round a line of sight that may float in front of the surface.
constexpr size_t kSurfaceAnchors = 3;
constexpr double kSurfaceShare = 0.05;
constexpr double kSurfaceCone = 1.005; // 1 / cos^2 of the 4 degrees round a line of sight
constexpr double kSteepest = 75;       // degrees from the horizon; looking straight down, no direction is upright
constexpr double kSteepestWalking = 35;
constexpr int kGridSide = 8; // number of places that are tried along each side of the ground

// Unit vector with the heading of `forward`, at most `steepest` degrees above or below the horizon.
dvec3 pitched(dvec3 forward, dvec3 up, double steepest)
{
    const double height = std::clamp(dot(forward, up), -std::sin(degrees(steepest)), std::sin(degrees(steepest)));
    dvec3 flat = forward - up * dot(forward, up);
    if (length(flat) < 1e-9) // straight up or down has no heading, so any will do
        flat = std::abs(up.x) < 0.9 ? cross(up, dvec3{1, 0, 0}) : cross(up, dvec3{0, 1, 0});
    return normalized(flat) * std::sqrt(1 - height * height) + up * height;
}

// The candidate for which `worth` is largest, the first of equals. Precondition: there is a candidate.
template <typename T, typename Worth>
T best(const std::vector<T>& candidates, const Worth& worth)
{
    size_t at = 0;
    double most = -1;
    for (size_t i = 0; i < candidates.size(); ++i) {
        throwIfInterrupted();
        const double value = worth(candidates[i]);
        if (value > most) {
            most = value;
            at = i;
        }
    }
    return candidates[at];
}

} // namespace

PathPlaces::PathPlaces(const ModelSurvey& survey, const PathLens& lens)
    : m_survey(survey), m_lens(lens), m_sample(everyNth(survey.seen, kScorePoints))
{
    for (const SourceCamera& camera : everyNth(survey.cameras, kMostPlaces))
        m_standing.push_back(
            {eyeOf(camera), pitched(axisOf(camera, 2), survey.site.up,
                                    survey.kind == CaptureKind::Aerial ? kSteepest : kSteepestWalking)});
    for (const dvec3& p : everyNth(m_sample, kFamiliarPoints)) {
        Seen seen{p, {}};
        for (const SourceCamera& camera : everyNth(survey.cameras, kMostPlaces))
            if (sees(camera, p))
                seen.rays.push_back(normalized(p - eyeOf(camera)));
        if (!seen.rays.empty())
            m_familiar.push_back(std::move(seen));
    }
    findTarget();
}

double PathPlaces::worthOf(const Walk& walk) const
{
    double least = 1e300;
    for (const double t : {0.0, 0.33, 0.67, 1.0})
        least = std::min(least, worth(along(walk, m_survey.site.up, t)));
    return least;
}

void PathPlaces::findTarget()
{
    const PathSite& site = m_survey.site;
    const std::vector<dvec3> candidates = everyNth(m_survey.seen, 1500);
    if (m_survey.cameras.empty()) {
        m_target = pathTarget(site);
    } else {
        m_target = best(candidates, [&](dvec3 p) {
            double sum = 0;
            for (size_t i = 0; i < m_survey.cameras.size(); ++i) {
                const dvec3 d = p - eyeOf(m_survey.cameras[i]), forward = axisOf(m_survey.cameras[i], 2);
                const double depth = dot(d, forward) / m_survey.distances[i];
                const double aside = length(cross(normalized(d), forward));
                // counts points near the middle of the picture at the distance of the photographed surface; points
                // farther away may be hidden
                if (depth > 0)
                    sum += std::exp(-8 * aside * aside - 4 * (depth - 1) * (depth - 1));
            }
            return sum;
        });
    }
    // moves the target to the median of the anchors round it, because a single stray anchor should not be looked at
    for (double radius = 0.15 * m_survey.viewing_distance; radius < 1e3 * m_survey.viewing_distance; radius *= 2) {
        std::vector<dvec3> near;
        for (const dvec3& p : m_survey.seen)
            if (dot(p - m_target, p - m_target) < radius * radius)
                near.push_back(p);
        if (near.size() < 8)
            continue;
        m_target = site.axis[0] * quantileAlong(near, site.axis[0], 0.5) +
                   site.axis[1] * quantileAlong(near, site.axis[1], 0.5) + site.up * quantileAlong(near, site.up, 0.5);
        return;
    }
}

std::vector<Walk> PathPlaces::walksOnGround(double metres) const
{
    const PathSite& site = m_survey.site;
    std::vector<Walk> found, high;
    const int steps = std::max(2, int(metres / 2));
    for (int u = 0; u < kGridSide; ++u)
        for (int v = 0; v < kGridSide; ++v)
            for (int heading = 0; heading < 360; heading += 45) {
                const dvec3 way = radialDirection(site, degrees(heading), 0) * (metres * site.metre);
                dvec3 first = site.axis[0] * lerp(site.low[0], site.high[0], (u + 0.5) / kGridSide) +
                              site.axis[1] * lerp(site.low[1], site.high[1], (v + 0.5) / kGridSide);
                double ground = -1e300;
                for (int i = 0; i <= steps; ++i)
                    ground = std::max(ground, groundNear(first + way * (i / double(steps))));
                first = first + site.up * (ground + kEyeHeight * site.metre);
                // looks 25 degrees down, because a model photographed from above is worst towards the horizon
                const dvec3 forward = radialDirection(site, degrees(heading), degrees(25));
                const bool roof = ground > site.ground + kHighestShare * site.view_height;
                (roof ? high : found).push_back({{first, forward}, {first + way, forward}});
            }
    return found.empty() ? high : found;
}

std::vector<Walk> PathPlaces::walks(double metres) const
{
    const dvec3 up = m_survey.site.up;
    const double wanted = metres * m_survey.site.metre;
    if (m_survey.fromAbove())
        return walksOnGround(metres);
    std::vector<Walk> found;
    double longest = 0;
    for (const Place& a : m_standing)
        for (const Place& b : m_standing) {
            const double way = length(b.position - a.position);
            if (way > 0 && dot(a.forward, b.forward) > 0.5 && std::abs(dot(b.position - a.position, up)) < 0.5 * way) {
                found.push_back({a, b});
                longest = std::max(longest, std::min(way, wanted));
            }
        }
    std::erase_if(found, [&](const Walk& w) { return length(w.last.position - w.first.position) < 0.7 * longest; });
    for (Walk& walk : found) {
        const double way = length(walk.last.position - walk.first.position);
        walk.last = along(walk, up, std::min(1.0, wanted / way));
    }
    if (found.empty()) // all cameras stand in one place, or look in different directions: step sideways from each
        for (const Place& a : m_standing)
            found.push_back(
                {a, {a.position + cross(level(a.forward), up) * std::min(wanted, m_survey.site.metre), a.forward}});
    return found;
}

Walk PathPlaces::walk(double metres) const
{
    return best(walks(metres), [this](const Walk& w) {
        // prefers walks in the direction of view, as most people walk
        const double ahead = dot(level(w.last.position - w.first.position), level(w.first.forward));
        return worthOf(w) * (1.5 + ahead);
    });
}

Walk PathPlaces::walkThrough(double metres) const
{
    const double way = metres * m_survey.site.metre;
    std::vector<Walk> found;
    if (m_survey.fromAbove())
        found = walksOnGround(metres);
    for (const Place& place : m_standing) {
        const dvec3 forward = level(m_target - place.position);
        // the walk starts at the camera at the earliest, because a wall may be behind it
        const double before = dot(m_target - place.position, forward);
        for (const double beyond : {0.4, 0.2, 0.05})
            if (const dvec3 last = m_target + forward * (beyond * way); m_survey.kind != CaptureKind::Aerial)
                found.push_back({{last - forward * std::min(way, before + beyond * way), forward}, {last, forward}});
    }
    return best(found, [&](const Walk& w) {
        size_t hit = 0;
        for (int i = 0; i <= 12; ++i)
            hit += crowd(lerp(w.first.position, w.last.position, i / 12.0), 0.3 * m_survey.site.metre);
        // the walk may end before a wall, but something must be in view
        return std::log2(2 + double(hit)) * std::min({worth(w.first), worth(w.last) + 0.05 * share(w.last), 0.2});
    });
}

Place PathPlaces::amidLevels(const std::vector<double>& distances, double reach, double& chosen) const
{
    struct Choice {
        Place place;
        double distance;
    };
    std::vector<Choice> candidates;
    for (const Place& place : m_standing)
        for (const double distance : distances)
            candidates.push_back({place, distance});
    const auto hits = [&](const Choice& c) {
        size_t count = 0;
        for (const dvec3& p : m_sample) {
            const dvec3 d = p - c.place.position;
            count += std::abs(length(d) - c.distance) < reach && dot(d, c.place.forward) > 0.7 * length(d);
        }
        return double(count);
    };
    chosen = 0;
    if (candidates.empty())
        return {};
    const Choice found = best(candidates, hits);
    if (hits(found) > 0)
        chosen = found.distance;
    return found.place;
}

Arc PathPlaces::arc(double width) const
{
    const PathSite& site = m_survey.site;
    Arc arc;
    arc.target = m_target;
    std::vector<double> distances, downs, headings;
    for (const SourceCamera& camera : m_survey.cameras) {
        if (!sees(camera, m_target))
            continue;
        const dvec3 d = m_target - eyeOf(camera);
        distances.push_back(length(d));
        downs.push_back(std::asin(std::clamp(-dot(normalized(d), site.up), -1.0, 1.0)) / degrees(1));
        headings.push_back(std::atan2(dot(d, site.axis[1]), dot(d, site.axis[0])) / degrees(1));
    }
    const double distance = distances.empty() ? m_survey.viewing_distance : quantile(distances, 0.5);
    arc.down = std::clamp(downs.empty() ? 35.0 : quantile(downs, 0.5), -10.0, 55.0);
    std::vector<Arc> candidates;
    const auto round = [&](dvec3 target, double away, int step) {
        for (int heading = 0; heading < 360; heading += step) {
            arc.target = target;
            arc.distance = std::max(away, 2 * m_survey.near_z);
            arc.heading = heading;
            candidates.push_back(arc);
        }
    };
    for (const double nearer : {1.0, 0.75, 0.5, 0.35})
        round(m_target, distance * nearer, 15);
    // space may be narrow: also circle round what a camera sees close in front of it
    if (m_survey.kind == CaptureKind::Around)
        for (const Place& place : everyNth(m_standing, 16))
            for (const double metres : {2.0, 3.5})
                if (const double away = metres * site.metre; away < distance)
                    round(place.position + place.forward * away, away, 30);
    return best(candidates, [&](const Arc& a) {
        size_t within = 0;
        for (const double heading : headings)
            within += std::abs(std::remainder(heading - a.heading, 360)) < 0.5 * width;
        double least = 1e300;
        for (const double t : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
            const dvec3 forward = radialDirection(site, degrees(a.heading + t * width), degrees(a.down));
            const dvec3 eye = a.target - forward * a.distance;
            least = std::min(least, worth({eye, forward}) * freedom(eye));
        }
        return least * (0.2 + double(within) / double(headings.size() + 1));
    });
}

Turn PathPlaces::turn() const
{
    std::vector<Turn> candidates;
    std::vector<dvec3> eyes;
    if (m_survey.fromAbove())
        for (const Walk& walk : everyNth(walksOnGround(1), kMostPlaces))
            eyes.push_back(walk.first.position);
    else
        for (const Place& place : m_standing)
            eyes.push_back(place.position);
    for (const dvec3& eye : eyes)
        for (int first = 0; first < 360; first += 30)
            candidates.push_back({eye, double(first)});
    return best(candidates, [&](const Turn& t) {
        double least = 1e300, sum = 0;
        for (int i = 0; i <= 4; ++i) {
            const double value = worth({t.eye, radialDirection(m_survey.site, degrees(t.heading + 45 * i), 0)});
            least = std::min(least, value);
            sum += value;
        }
        return least + 0.05 * sum;
    });
}

Place PathPlaces::closeUp(double& distance) const
{
    distance = std::max(kArmLength * m_survey.site.metre, 1.5 * m_survey.near_z);
    std::vector<Place> candidates;
    std::vector<double> depths;
    // the middle of a photograph shows a surface, and nothing stands before it
    for (const Place& place : m_standing) {
        depths.clear();
        for (const dvec3& p : m_survey.seen) {
            const dvec3 d = p - place.position;
            if (const double depth = dot(d, place.forward); depth > 0 && dot(d, d) < depth * depth * kSurfaceCone)
                depths.push_back(depth);
        }
        if (depths.size() <= kSurfaceAnchors)
            continue;
        const double depth = quantile(depths, std::max(kSurfaceShare, double(kSurfaceAnchors) / double(depths.size())));
        if (depth > distance)
            candidates.push_back({place.position + place.forward * (depth - distance), place.forward});
    }
    if (candidates.empty())
        for (int heading = 0; heading < 360; heading += 30) {
            const dvec3 forward = radialDirection(m_survey.site, degrees(heading), degrees(45));
            candidates.push_back({m_target - forward * distance, forward});
        }
    return best(candidates, [&](const Place& place) {
        // prefers places where many anchors lie at that distance
        const size_t near = crowd(place.position + place.forward * distance, distance);
        return std::min(share(place), 0.2) * std::log2(2 + double(near)) /
               (1 + double(crowd(place.position, 0.5 * distance)));
    });
}

std::vector<Place> PathPlaces::apart(size_t count) const
{
    std::vector<Place> from = m_standing;
    if (m_survey.fromAbove()) {
        // adds the best quarter of the places on the ground
        std::vector<Walk> ground = walksOnGround(1);
        std::vector<std::pair<double, size_t>> order;
        for (size_t i = 0; i < ground.size(); ++i)
            order.push_back({-worth(ground[i].first), i});
        std::sort(order.begin(), order.end());
        for (size_t i = 0; i < order.size() / 4; ++i)
            from.push_back(ground[order[i].second].first);
    }
    std::vector<Place> chosen = {best(from, [this](const Place& place) { return worth(place); })};
    while (chosen.size() < count)
        chosen.push_back(best(from, [&](const Place& place) {
            double nearest = 1e300;
            for (const Place& c : chosen)
                nearest = std::min(nearest, length(c.position - place.position));
            return share(place) > 0.02 ? nearest : 0;
        }));
    return chosen;
}

} // namespace gsc
