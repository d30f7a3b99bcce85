// SPDX-License-Identifier: Apache-2.0
// Surveys a model by its anchors and cameras: ground, scale, views of the cameras, and places where one can stand.
#pragma once

#include "convert/survey/path_site.h"
#include <gsc/gsc_reader.h>
#include "runtime/cameras/length.h"

#include <string>
#include <vector>

namespace gsc {

enum class CaptureKind {
    Aerial, // the cameras look down on the ground from the air
    Inward, // the cameras stand round something and look at it
    Around, // the cameras stand on the ground and look about, as in a room or a street
    // there are no cameras, or they see nothing of the model; only the bounds are used
    None,
};

const char* captureName(CaptureKind kind);

struct ModelSurvey {
    CaptureKind kind = CaptureKind::None;
    PathSite site;
    std::string metre_rule; // how site.metre was found, as one sentence without a full stop
    // world units: median of `distances`; without cameras the height from which the bounds fill a picture
    double viewing_distance = 0;
    double near_z = 0;
    double top = 0;            // height along up below which 98 % of the seen anchors lie
    std::vector<dvec3> points; // positions of the anchors; of a large model every n-th
    std::vector<dvec3> seen;   // positions of the anchors that the cameras see well; of all if there are no cameras
    // cameras that see something; their appearance is a row that the file holds, or -1
    std::vector<SourceCamera> cameras;
    // for each camera, in world units, the median depth of the well-seen anchors in the middle of its picture
    std::vector<double> distances;

    // Returns true if the viewer looks down on the model: an aerial capture, or an unknown one.
    [[nodiscard]] bool fromAbove() const { return kind == CaptureKind::Aerial || kind == CaptureKind::None; }
};

// Number of anchors in a survey; of larger models, every n-th anchor is used.
constexpr uint64_t kSurveyAnchors = 120'000;

// Surveys a model. `metre`: used as it is unless its units are 0, then derived. `name` is used in messages.
// Precondition: `view` came from openGsc() without errors. Throws Error(Unsupported) if fewer than 16 anchors have a
// finite position.
ModelSurvey surveyModel(const GscView& view, const std::string& name, const Metre& metre = {});

// Appends the positions of the anchors of one chunk that a survey uses. Needs header, params and levels of `view`;
// `payload` holds the chunk's arrays.
void addSurveyPoints(const GscView& view, const ChunkRecord& chunk, std::span<const std::byte> payload,
                     std::vector<dvec3>& points);

// Surveys a model by points that addSurveyPoints() gathered from all chunks in order. Needs params, cameras, camera
// names and embedding_rows of `view`. `metre`, `name` and errors are those of surveyModel().
ModelSurvey surveyPoints(const GscView& view, std::vector<dvec3> points, const std::string& name,
                         const Metre& metre = {});

} // namespace gsc
