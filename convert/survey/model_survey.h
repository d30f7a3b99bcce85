// SPDX-License-Identifier: Apache-2.0
// Survey of a model from its anchors and cameras: ground, scale, the cameras' views, and places where one can stand.
#pragma once

#include "convert/survey/path_site.h"
#include <gsc/gsc_reader.h>
#include "runtime/cameras/length.h"

#include <string>
#include <vector>

namespace gsc {

enum class CaptureKind {
    Aerial, // the cameras look down on a ground
    Inward, // they stand round something and look at it
    Around, // they stand on the ground and look about, as in a room or a street
    None,   // no cameras, or they see nothing of the model: bounds alone
};

const char* captureName(CaptureKind kind);

struct ModelSurvey {
    CaptureKind kind = CaptureKind::None;
    PathSite site;
    std::string metre_rule;      // how site.metre was found, one sentence without a full stop
    double viewing_distance = 0; // median of the cameras' distances; the height of the bounds' view without cameras
    double near_z = 0;
    double top = 0;                    // along up, 98 % of the seen anchors are below
    std::vector<dvec3> points;         // anchors, every n-th of a large model
    std::vector<dvec3> seen;           // anchors that the training cameras see well; all if there are no cameras
    std::vector<SourceCamera> cameras; // cameras that see something; their appearance is a row that the file holds
    std::vector<double> distances; // for each camera, median depth of the well-seen anchors in the middle of its image

    // True if the viewer looks down on the model: an aerial capture, or an unknown one.
    [[nodiscard]] bool fromAbove() const { return kind == CaptureKind::Aerial || kind == CaptureKind::None; }
};

// Anchors that a survey looks at; of larger models every n-th.
constexpr uint64_t kSurveyAnchors = 120'000;

// `metre` is taken as it is, units 0 = to be derived. Precondition: `view` came from openGsc() without errors. `name` is
// used in messages. Throws Error(Unsupported) where there are fewer than 16 anchors with a finite position.
ModelSurvey surveyModel(const GscView& view, const std::string& name, const Metre& metre = {});

// The anchors that a survey of `view` looks at, chunk by chunk: addSurveyPoints() appends those of one chunk. Needs
// header, params and levels of `view`; `payload` holds the chunk's arrays.
void addSurveyPoints(const GscView& view, const ChunkRecord& chunk, std::span<const std::byte> payload,
                     std::vector<dvec3>& points);

// The survey of the points of all chunks in order. Needs params, cameras, their names and embedding_rows of `view`.
// `metre` and errors are those of surveyModel().
ModelSurvey surveyPoints(const GscView& view, std::vector<dvec3> points, const std::string& name,
                         const Metre& metre = {});

} // namespace gsc
