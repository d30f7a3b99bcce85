// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/model_survey.h"

#include "format/error.h"
#include "format/interrupt.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

namespace gsc {

namespace {

constexpr size_t kLeastAnchors = 16, kLeastSeen = 100;
constexpr size_t kMostViews = 256;       // of a long capture every n-th camera
constexpr double kAerialPitch = 10;      // degrees below the horizon, median of the cameras
constexpr double kAerialAbove = 0.8;     // of the well-seen anchors are below the median camera
constexpr double kUprightAgreement = 40; // degrees between the ground's normal and the cameras' up
constexpr double kAerialMetres = 20;     // the capture height of an aerial model
constexpr double kLeastEyeHeight = 0.02; // of the viewing distance: below it, the ground was hardly found
constexpr double kInwardMetres = 3;      // the distance to what an inward capture looks at

Vec3 anchorPosition(const ModelParams& params, const LevelRecord& level, const ChunkRecord& chunk,
                    const std::byte* payload, const ChunkArrayLayout& layout, uint32_t i)
{
    const std::byte* at = payload + layout.offset[0] + layout.stride[0] * i;
    if (params.position_encoding != uint32_t(PositionEncoding::Grid)) {
        float p[3];
        std::memcpy(p, at, sizeof(p));
        return {double(p[0]), double(p[1]), double(p[2])};
    }
    GridPosition p;
    std::memcpy(&p, at, sizeof(p));
    double out[3];
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = double(
            gridCoordinate(int32_t(int64_t(chunk.origin[axis]) + p.local[axis]), level.quantum, level.origin, false));
    return {out[0], out[1], out[2]};
}

std::vector<Vec3> anchorPoints(const GscView& view)
{
    std::vector<Vec3> points;
    for (const ChunkRecord& chunk : view.chunks) {
        throwIfInterrupted();
        addSurveyPoints(view, chunk, chunkPayload(view, chunk).data(), points);
    }
    return points;
}

// Training cameras, or all where too few were trained on.
std::vector<SurveyCamera> storedCameras(const GscView& view)
{
    std::vector<const CameraRecord*> records;
    for (const CameraRecord& c : view.cameras)
        if (!c.is_test)
            records.push_back(&c);
    if (records.size() < kMinViews) {
        records.clear();
        for (const CameraRecord& c : view.cameras)
            records.push_back(&c);
    }
    std::vector<SurveyCamera> cameras;
    const size_t step = std::max<size_t>(1, (records.size() + kMostViews - 1) / kMostViews);
    for (size_t i = 0; i < records.size(); i += step) {
        const CameraRecord& c = *records[i];
        SurveyCamera camera;
        camera.view = pinholeView(c.position, c.rotation, c.fx, c.fy, c.width, c.height);
        for (size_t row = 0; row < view.embedding_rows.size(); ++row)
            if (c.appearance >= 0 && view.embedding_rows[row] == uint32_t(c.appearance))
                camera.appearance = c.appearance;
        cameras.push_back(camera);
    }
    return cameras;
}

std::vector<PinholeView> viewsOf(const std::vector<SurveyCamera>& cameras)
{
    std::vector<PinholeView> views;
    for (const SurveyCamera& c : cameras)
        views.push_back(c.view);
    return views;
}

// Depth of what lies in the middle quarter of the image; cameras that see nothing there are dropped.
void measureDistances(ModelSurvey& survey)
{
    std::vector<double> depths;
    for (SurveyCamera& camera : survey.cameras) {
        throwIfInterrupted();
        PinholeView middle = camera.view;
        middle.width *= 0.5;
        middle.height *= 0.5;
        depths.clear();
        for (const Vec3& p : survey.seen)
            if (sees(middle, p))
                depths.push_back(dot(p - middle.position, middle.forward()));
        camera.distance = depths.empty() ? 0 : quantile(depths, 0.5);
    }
    std::erase_if(survey.cameras, [](const SurveyCamera& c) { return !(c.distance > 0); });
    depths.clear();
    for (const SurveyCamera& camera : survey.cameras)
        depths.push_back(camera.distance);
    survey.viewing_distance = depths.empty() ? 0 : quantile(depths, 0.5);
}

// Photographs are hardly ever tilted sideways: up is what their right axes are most nearly perpendicular to. False if
// the right axes are too much alike to tell.
bool upOfCameras(const std::vector<SurveyCamera>& cameras, Vec3& up)
{
    double m[3][3] = {}, values[3];
    Vec3 axes[3], sum;
    for (const SurveyCamera& c : cameras) {
        const Vec3 right = c.view.column(0);
        const double r[3] = {right.x, right.y, right.z};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                m[i][j] += r[i] * r[j];
        sum = sum - c.view.column(1) - c.view.forward(); // the sky is above the picture or behind the camera
    }
    principalAxes(m, axes, values);
    up = axes[2] * (dot(sum, axes[2]) >= 0 ? 1.0 : -1.0);
    return values[2] < 0.5 * values[1];
}

double spread(const std::vector<Vec3>& points)
{
    Vec3 mean;
    for (const Vec3& p : points)
        mean = mean + p * (1.0 / double(points.size()));
    double sum = 0;
    for (const Vec3& p : points)
        sum += dot(p - mean, p - mean);
    return sum;
}

CaptureKind kindOf(const std::vector<SurveyCamera>& cameras, const std::vector<Vec3>& seen, Vec3 up)
{
    std::vector<double> pitches, heights;
    std::vector<Vec3> eyes, looked_at;
    for (const SurveyCamera& c : cameras) {
        pitches.push_back(std::asin(std::clamp(-dot(c.view.forward(), up), -1.0, 1.0)));
        heights.push_back(dot(c.view.position, up));
        eyes.push_back(c.view.position);
        looked_at.push_back(c.view.position + c.view.forward() * c.distance);
    }
    if (quantile(pitches, 0.5) > degrees(kAerialPitch) &&
        quantile(heights, 0.5) > quantileAlong(seen, up, kAerialAbove))
        return CaptureKind::Aerial;
    return spread(looked_at) < spread(eyes) ? CaptureKind::Inward : CaptureKind::Around;
}

GroundFrame frameOf(ModelSurvey& survey)
{
    const std::vector<PinholeView> views = viewsOf(survey.cameras);
    if (survey.cameras.empty()) {
        survey.kind = CaptureKind::None;
        return fitGround(survey.seen, {});
    }
    const GroundFrame flat = fitGround(survey.seen, views);
    Vec3 up;
    if (!upOfCameras(survey.cameras, up))
        up = flat.up;
    survey.kind = kindOf(survey.cameras, survey.seen, up);
    if (survey.kind != CaptureKind::Aerial)
        return fitGroundAlong(survey.seen, views, up, 0.05);
    if (flat.capture_height > 0 && dot(flat.up, up) > std::cos(degrees(kUprightAgreement)))
        return flat;
    return fitGroundAlong(survey.seen, views, up, 0.5);
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

ModelSurvey surveyPoints(const GscView& view, std::vector<Vec3> points, const std::string& name, const Metre& metre)
{
    ModelSurvey survey;
    survey.near_z = double(view.params->near_z);
    survey.points = std::move(points);
    if (survey.points.size() < kLeastAnchors)
        throw Error(ErrorCode::Unsupported,
                    formatString("%s: %zu anchors with a finite position, expected at least %zu; there is nothing to "
                                 "move about in",
                                 name.c_str(), survey.points.size(), kLeastAnchors));
    survey.cameras = storedCameras(view);
    const std::vector<PinholeView> views = viewsOf(survey.cameras);
    for (const uint32_t least : {kMinViews, 1u}) {
        survey.seen.clear();
        for (const Vec3& p : survey.points)
            if (!views.empty() && wellSeen(views, std::min(least, uint32_t(views.size())), p))
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

    const GroundFrame frame = frameOf(survey);
    PathSite& site = survey.site;
    site.up = frame.up;
    for (int i = 0; i < 2; ++i) {
        site.axis[i] = frame.axis[i];
        site.low[i] = frame.low[i];
        site.high[i] = std::max(frame.high[i], frame.low[i] + 1e-6);
    }
    site.ground = frame.ground;
    site.view_height = frame.capture_height;
    survey.top = quantileAlong(survey.seen, site.up, 0.98);
    if (survey.cameras.empty())
        survey.viewing_distance = site.view_height =
            0.5 * std::max(site.high[0] - site.low[0], site.high[1] - site.low[1]);
    setMetre(survey, metre);
    setLevels(*view.params, site);
    if (!(site.metre > 0) || !std::isfinite(site.metre))
        throw Error(ErrorCode::Unsupported,
                    name + ": all anchors lie in one place, expected a model one can move about in; pass another one");
    return survey;
}

} // namespace

const char* captureName(CaptureKind kind)
{
    static constexpr const char* kNames[] = {"aerial", "inward", "around", "none"};
    return kNames[int(kind)];
}

void addSurveyPoints(const GscView& view, const ChunkRecord& chunk, const std::byte* payload, std::vector<Vec3>& points)
{
    const uint64_t step = (view.header->anchor_count + kSurveyAnchors - 1) / kSurveyAnchors;
    const ChunkArrayLayout layout = chunkArrayLayout(*view.params, chunk.anchor_count);
    const uint64_t first = (step - chunk.anchor_first % step) % step;
    for (uint64_t i = first; i < chunk.anchor_count; i += step) {
        const Vec3 p =
            anchorPosition(*view.params, view.levels[chunk.level_index], chunk, payload, layout, uint32_t(i));
        if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
            points.push_back(p);
    }
}

ModelSurvey surveyModel(const GscView& view, const std::string& name, const Metre& metre)
{
    return surveyPoints(view, anchorPoints(view), name, metre);
}

Metre surveyMetre(const GscView& view, std::vector<Vec3> points, const std::string& name)
{
    const ModelSurvey survey = surveyPoints(view, std::move(points), name, {});
    return {survey.site.metre, survey.metre_rule};
}

} // namespace gsc
