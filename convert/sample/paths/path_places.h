// SPDX-License-Identifier: Apache-2.0
// Places in a surveyed model that a path can lead to: in free space, with much in sight. Occlusion is not known; space
// is free where photographs were taken, and elsewhere if no anchors are near.
#pragma once

#include "convert/sample/paths/camera_motions.h"
#include "convert/survey/model_survey.h"

#include <span>
#include <vector>

namespace gsc {

// An arc round a target.
struct Arc {
    dvec3 target{};
    double distance = 0, heading = 0, down = 0; // degrees; the heading is that of the arc's middle
};

// Place and heading at which a turn of the head begins.
struct Turn {
    dvec3 eye{};
    double heading = 0; // degrees
};

class PathPlaces {
public:
    // Precondition: the survey outlives it.
    PathPlaces(const ModelSurvey& survey, const PathLens& lens);

    // Share of the well-seen anchors in the image of `place`, 0..1; nearer ones than the near plane do not count.
    [[nodiscard]] double share(const Place& place) const;
    // share(), higher where photographs show the anchors from that side, lower the more anchors crowd round the eye and
    // close before it.
    [[nodiscard]] double worth(const Place& place) const;

    // About `metres` long, among the cameras; of an aerial model above the ground at eye height.
    [[nodiscard]] Walk walk(double metres) const;
    // A walk like walk(), through as many anchors as a way of that length can meet.
    [[nodiscard]] Walk walkThrough(double metres) const;
    // `width` degrees wide, as the cameras see the target.
    [[nodiscard]] Arc arc(double width) const;
    // Start of a turn by 180 degrees with most anchors in sight.
    [[nodiscard]] Turn turn() const;
    // At arm's length before a surface that a camera looked at, or as near as the near plane allows: `distance` before
    // it, world units.
    [[nodiscard]] Place closeUp(double& distance) const;
    // Place with most anchors in sight at one of the `distances`, to within `reach`. `chosen`: that distance, 0 if
    // there is none.
    [[nodiscard]] Place amidLevels(const std::vector<double>& distances, double reach, double& chosen) const;
    // The survey's site, moved aside if need be, so that there is nothing from one share of its diagonal to another at
    // `height` above its ground.
    [[nodiscard]] PathSite flightSite(double from, double to, double& height) const;
    // Far apart from each other.
    [[nodiscard]] std::vector<Place> apart(size_t count) const;

private:
    struct Sight {
        double share = 0;
        size_t close = 0; // anchors close before the eye
    };
    // A well-seen anchor and the directions it was seen in.
    struct Seen {
        dvec3 position{};
        std::vector<dvec3> rays;
    };
    [[nodiscard]] Sight sight(const Place& place) const;
    [[nodiscard]] size_t crowd(dvec3 position, double radius) const;
    [[nodiscard]] double worthOf(const Walk& walk) const;
    [[nodiscard]] std::vector<Walk> walks(double metres) const;
    [[nodiscard]] std::vector<Walk> walksOnGround(double metres) const;
    // 0..1: behind a wall, or looking where no camera looked, it is low.
    [[nodiscard]] double familiarity(const Place& place) const;
    [[nodiscard]] double freedom(dvec3 eye) const;
    [[nodiscard]] double groundNear(dvec3 position) const;
    void findTarget();
    [[nodiscard]] dvec3 level(dvec3 direction) const; // horizontal part of a direction, as a unit vector

    const ModelSurvey& m_survey;
    PathLens m_lens;
    std::vector<dvec3> m_sample;   // seen anchors that scores count
    std::vector<Place> m_standing; // the cameras, every n-th of many
    std::vector<Seen> m_familiar;
    dvec3 m_target{}; // point in the middle of most photographs
};

} // namespace gsc
