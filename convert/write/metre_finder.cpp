// SPDX-License-Identifier: Apache-2.0
#include "convert/write/metre_finder.h"

#include "convert/sample/paths/model_survey.h"
#include "convert/write/model_sections.h"
#include "format/error.h"

namespace gsc {

struct MetreFinder::State {
    FileHeader header{};
    std::vector<LevelRecord> levels;
    GscView view;                           // of what is known before the file is there
    std::vector<std::vector<dvec3>> points; // per chunk
};

MetreFinder::MetreFinder(const ModelParams& params, const Partition& partition, uint64_t anchors)
    : m_state(std::make_unique<State>())
{
    m_state->points.resize(partition.chunks.size());
    m_state->header.anchor_count = anchors;
    m_state->levels.assign(partition.levels.begin(), partition.levels.end());
    m_state->view.header = &m_state->header;
    m_state->view.params = &params;
    m_state->view.levels = m_state->levels;
}

MetreFinder::~MetreFinder() = default;

void MetreFinder::addChunk(size_t index, const ChunkRecord& chunk, std::span<const std::byte> payload)
{
    addSurveyPoints(m_state->view, chunk, payload.data(), m_state->points[index]);
}

Metre MetreFinder::derive(const Checkpoint& checkpoint)
{
    std::vector<dvec3> points;
    for (const std::vector<dvec3>& part : m_state->points)
        points.insert(points.end(), part.begin(), part.end());
    const std::vector<std::byte> cameras = cameraSection(checkpoint);
    GscView& view = m_state->view;
    view.cameras = {reinterpret_cast<const CameraRecord*>(cameras.data()), checkpoint.cameras.size()};
    const size_t names = view.cameras.size_bytes();
    view.camera_names = {reinterpret_cast<const char*>(cameras.data()) + names, cameras.size() - names};
    try {
        const ModelSurvey survey = surveyPoints(view, std::move(points), checkpoint.model_path);
        return {survey.site.metre, survey.metre_rule};
    } catch (const Error& e) {
        if (e.code() != ErrorCode::Unsupported)
            throw;
        return {}; // a few anchors, or all in one place
    }
}

} // namespace gsc
