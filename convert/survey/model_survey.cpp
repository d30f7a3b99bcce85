// SPDX-License-Identifier: Apache-2.0
#include "convert/survey/model_survey.h"

#include "format/numbers/count_text.h"
#include "convert/survey/chunk_values.h"
#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "runtime/cameras/world_up.h"
#include <gsc/camera.h>

#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace gsc {

namespace {

constexpr size_t kLeastAnchors = 16, kLeastSeen = 100;
constexpr size_t kMostViews = 256;  // most cameras that are used; of more, an even sample
constexpr double kAerialPitch = 10; // aerial: the median camera looks down by at least so many degrees
// aerial: at least this share of the well-seen anchors lies below the median camera
constexpr double kAerialAbove = 0.8;
// largest angle in degrees between the ground's normal and the cameras' up
constexpr double kUprightAgreement = 40;
constexpr double kAerialMetres = 20; // metres above ground, assumed for an aerial model
// Least eye height as a share of the viewing distance; if it is below, the ground was probably not found.
constexpr double kLeastEyeHeight = 0.02;
// metres from a camera to what it shows, assumed if the cameras look inward
constexpr double kInwardMetres = 3;

// The training cameras, or all cameras if there are too few of those.
std::vector<SourceCamera> storedCameras(const GscView& view)
{
    std::vector<SourceCamera> all;
    for (const CameraRecord& record : view.cameras) {
        SourceCamera camera = sourceCamera(record, view.camera_names);
        const auto& rows = view.embedding_rows;
        if (std::find(rows.begin(), rows.end(), uint32_t(camera.appearance)) == rows.end())
            camera.appearance = -1;
        all.push_back(std::move(camera));
    }
    if (std::count_if(all.begin(), all.end(), [](const SourceCamera& c) { return !c.is_test; }) >= kMinViews)
        std::erase_if(all, [](const SourceCamera& c) { return c.is_test; });
    return everyNth(all, kMostViews);
}

// Sets for each camera the median depth of the well-seen anchors in the middle quarter of its picture. Removes cameras
// that see none there.
void measureDistances(ModelSurvey& survey)
{
    std::vector<double> depths;
    std::vector<SourceCamera> sighted;
    for (SourceCamera& camera : survey.cameras) {
        throwIfInterrupted();
        depths.clear();
        for (const dvec3& p : survey.seen)
            if (sees(camera, p, 0.5))
                depths.push_back(dot(p - eyeOf(camera), axisOf(camera, 2)));
        if (depths.empty())
            continue;
        survey.distances.push_back(quantile(depths, 0.5));
        sighted.push_back(std::move(camera));
    }
    survey.cameras = std::move(sighted);
    std::vector<double> distances = survey.distances;
    survey.viewing_distance = distances.empty() ? 0 : quantile(distances, 0.5);
}

std::optional<dvec3> upOfCameras(const std::vector<SourceCamera>& cameras)
{
    std::vector<ViewAxes> views;
    for (const SourceCamera& c : cameras)
        views.push_back({axisOf(c, 0), axisOf(c, 1), axisOf(c, 2)});
    return upOfViews(views);
}

double spread(const std::vector<dvec3>& points)
{
    const dvec3 mean = meanOf(points);
    double sum = 0;
    for (const dvec3& p : points)
        sum += dot(p - mean, p - mean);
    return sum;
}

CaptureKind kindOf(const ModelSurvey& survey, dvec3 up)
{
    std::vector<double> pitches, heights;
    std::vector<dvec3> eyes, looked_at;
    for (size_t i = 0; i < survey.cameras.size(); ++i) {
        const dvec3 eye = eyeOf(survey.cameras[i]), forward = axisOf(survey.cameras[i], 2);
        pitches.push_back(std::asin(std::clamp(-dot(forward, up), -1.0, 1.0)));
        heights.push_back(dot(eye, up));
        eyes.push_back(eye);
        looked_at.push_back(eye + forward * survey.distances[i]);
    }
    if (quantile(pitches, 0.5) > degrees(kAerialPitch) &&
        quantile(heights, 0.5) > quantileAlong(survey.seen, up, kAerialAbove))
        return CaptureKind::Aerial;
    return spread(looked_at) < spread(eyes) ? CaptureKind::Inward : CaptureKind::Around;
}

GroundFrame frameOf(ModelSurvey& survey)
{
    const std::vector<SourceCamera>& cameras = survey.cameras;
    const GroundFrame flat = fitGround(survey.seen, cameras);
    if (cameras.empty())
        return flat;
    const dvec3 up = upOfCameras(cameras).value_or(flat.up);
    survey.kind = kindOf(survey, up);
    if (survey.kind != CaptureKind::Aerial)
        return fitGroundAlong(survey.seen, cameras, up, 0.05);
    if (flat.view_height > 0 && dot(flat.up, up) > std::cos(degrees(kUprightAgreement)))
        return flat;
    return fitGroundAlong(survey.seen, cameras, up, 0.5);
}

void setMetre(ModelSurvey& survey, const Metre& given)
{
    PathSite& site = survey.site;
    const double height = site.view_height, distance = survey.viewing_distance;
    if (given.units > 0) {
        site.metre = given.units;
        survey.metre_rule = given.rule;
    } else if (survey.kind == CaptureKind::None) {
        site.metre = metreOfGround(site.high[0] - site.low[0], site.high[1] - site.low[1]);
        survey.metre_rule = "no cameras: 0.0625 of the square root of the ground's area";
    } else if (survey.kind == CaptureKind::Aerial && height > 0) {
        site.metre = height / kAerialMetres;
        survey.metre_rule = "seen from the air: the cameras' median height above ground is 20 m";
    } else if (survey.kind == CaptureKind::Around && height > kLeastEyeHeight * distance && height < distance) {
        site.metre = height / kEyeHeight;
        survey.metre_rule = "seen from within: the cameras' median height above ground is 1.6 m";
    } else {
        site.metre = distance / kInwardMetres;
        survey.metre_rule = "seen from around: the cameras' median distance to what they look at is 3 m";
    }
}

void setLevels(const ModelParams& params, PathSite& site)
{
    if (!(params.flags & kModelHasLevels))
        return;
    site.level_rule = LevelRule(params.level_rule);
    site.standard_dist = double(params.standard_dist);
    site.fork = params.fork;
    site.finest_level = params.level_clamp;
}

} // namespace

const char* captureName(CaptureKind kind)
{
    static constexpr const char* kNames[] = {"aerial", "inward", "around", "none"};
    return kNames[int(kind)];
}

void addSurveyPoints(const GscView& view, const ChunkRecord& chunk, std::span<const std::byte> payload,
                     std::vector<dvec3>& points)
{
    const uint64_t step = (view.header->anchor_count + kSurveyAnchors - 1) / kSurveyAnchors;
    const LevelRecord& level = view.levels[chunk.level_index];
    const ChunkValues values(*view.params, chunk, level.quantum, level.origin, payload);
    const uint64_t first = (step - chunk.anchor_first % step) % step;
    for (uint64_t i = first; i < chunk.anchor_count; i += step) {
        const dvec3 p = glm::make_vec3(values.position(uint32_t(i)).data());
        if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
            points.push_back(p);
    }
}

ModelSurvey surveyPoints(const GscView& view, std::vector<dvec3> points, const std::string& name, const Metre& metre)
{
    ModelSurvey survey;
    survey.near_z = double(view.params->near_z);
    survey.points = std::move(points);
    if (survey.points.size() < kLeastAnchors)
        throw Error(ErrorCode::Unsupported, name,
                    formatCount(survey.points.size(), "anchor") + " with a finite position",
                    formatString("at least %zu", kLeastAnchors), "there is nothing to move about in");
    survey.cameras = storedCameras(view);
    const std::vector<SourceCamera>& cameras = survey.cameras;
    for (const uint32_t least : {kMinViews, 1u}) {
        survey.seen.clear();
        for (const dvec3& p : survey.points)
            if (!cameras.empty() && wellSeen(cameras, std::min(least, uint32_t(cameras.size())), p))
                survey.seen.push_back(p);
        if (survey.seen.size() >= std::min(kLeastSeen, survey.points.size() / 2))
            break;
        survey.seen.clear();
    }
    if (survey.seen.empty())
        survey.cameras.clear();
    measureDistances(survey);
    if (survey.cameras.empty())
        survey.seen = survey.points;

    PathSite& site = survey.site;
    static_cast<GroundFrame&>(site) = frameOf(survey);
    for (int i = 0; i < 2; ++i)
        site.high[i] = std::max(site.high[i], site.low[i] + 1e-6);
    survey.top = quantileAlong(survey.seen, site.up, 0.98);
    if (survey.cameras.empty())
        survey.viewing_distance = site.view_height =
            0.5 * std::max(site.high[0] - site.low[0], site.high[1] - site.low[1]);
    setMetre(survey, metre);
    setLevels(*view.params, site);
    if (!(site.metre > 0) || !std::isfinite(site.metre))
        throw Error(ErrorCode::Unsupported, name, "all anchors lie in one place", "a model one can move about in",
                    "pass another one");
    return survey;
}

ModelSurvey surveyModel(const GscView& view, const std::string& name, const Metre& metre)
{
    std::vector<dvec3> points;
    for (const ChunkRecord& chunk : view.chunks) {
        throwIfInterrupted();
        addSurveyPoints(view, chunk, chunkPayload(view, chunk), points);
    }
    return surveyPoints(view, std::move(points), name, metre);
}

} // namespace gsc
