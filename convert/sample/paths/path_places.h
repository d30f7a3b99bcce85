// SPDX-License-Identifier: Apache-2.0
// Finds places in a surveyed model for a path: in free space, with much in view. Whether anchors hide others is not
// known; space counts as free where photographs were taken, and elsewhere if no anchors are near.
#pragma once

#include "convert/sample/paths/camera_motions.h"
#include "convert/survey/model_survey.h"

#include <span>
#include <vector>

namespace gsc {

// An arc round a target, at a constant distance from it.
struct Arc {
    dvec3 target{};
    // distance in world units; heading of the middle of the arc and downward angle, in degrees
    double distance = 0, heading = 0, down = 0;
};

// Place and heading at which a turn of the head begins.
struct Turn {
    dvec3 eye{};
    double heading = 0; // heading in degrees
};

class PathPlaces {
public:
    // Precondition: `survey` outlives this.
    PathPlaces(const ModelSurvey& survey, const PathLens& lens);

    // Share, 0 to 1, of the well-seen anchors that are in view at `place`, without those before the near plane.
    [[nodiscard]] double share(const Place& place) const;
    // share(), raised if photographs show those anchors from that side, lowered by anchors round the eye and close in
    // front of it.
    [[nodiscard]] double worth(const Place& place) const;

    // Best walk of about `metres`: between places of cameras, or, in a model photographed from above, on the ground at
    // eye height.
    [[nodiscard]] Walk walk(double metres) const;
    // Walk of at most `metres` that passes through as many anchors as possible.
    [[nodiscard]] Walk walkThrough(double metres) const;
    // Best arc of `width` degrees round the target, at about the distance and angle of the cameras that see it.
    [[nodiscard]] Arc arc(double width) const;
    // Start of the turn by 180 degrees that has most anchors in view.
    [[nodiscard]] Turn turn() const;
    // Place at arm's length before a surface that a camera looked at, or, if that is nearer than the near plane allows,
    // at the least distance. Sets `distance`, in world units.
    [[nodiscard]] Place closeUp(double& distance) const;
    // Place with most anchors at one of `distances` from it, to within `reach`, all in world units. `chosen`: that
    // distance, 0 if no place has any.
    [[nodiscard]] Place amidLevels(const std::vector<double>& distances, double reach, double& chosen) const;
    // The survey's site, moved sideways if needed, so that no anchor is near the line between the shares `from` and
    // `to` of its diagonal, `height` above the ground. Sets `height`.
    [[nodiscard]] PathSite flightSite(double from, double to, double& height) const;
    // Returns `count` places far apart from each other.
    [[nodiscard]] std::vector<Place> apart(size_t count) const;

private:
    struct Sight {
        double share = 0;
        size_t close = 0; // number of anchors close in front of the eye
    };
    // A well-seen anchor, and the directions in which cameras saw it.
    struct Seen {
        dvec3 position{};
        std::vector<dvec3> rays;
    };
    [[nodiscard]] Sight sight(const Place& place) const;
    [[nodiscard]] size_t crowd(dvec3 position, double radius) const;
    [[nodiscard]] double worthOf(const Walk& walk) const;
    [[nodiscard]] std::vector<Walk> walks(double metres) const;
    [[nodiscard]] std::vector<Walk> walksOnGround(double metres) const;
    // How well photographs show the anchors in view from this side, 0 to 1: low behind a wall or where no camera
    // looked.
    [[nodiscard]] double familiarity(const Place& place) const;
    [[nodiscard]] double freedom(dvec3 eye) const;
    [[nodiscard]] double groundNear(dvec3 position) const;
    void findTarget();
    [[nodiscard]] dvec3 level(dvec3 direction) const; // direction without its vertical part, as a unit vector

    const ModelSurvey& m_survey;
    PathLens m_lens;
    std::vector<dvec3> m_sample;   // a sample of the well-seen anchors
    std::vector<Place> m_standing; // a sample of the cameras
    std::vector<Seen> m_familiar;
    dvec3 m_target{}; // the point that is in the middle of most photographs
};

} // namespace gsc
