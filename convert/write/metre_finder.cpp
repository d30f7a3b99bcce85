// SPDX-License-Identifier: Apache-2.0
#include "convert/write/metre_finder.h"

#include "convert/survey/model_survey.h"
#include "convert/write/model_sections.h"
#include <gsc/error.h>

namespace gsc {

MetreFinder::MetreFinder(const ModelParams& params, const Partition& partition, uint64_t anchors)
    : m_levels(partition.levels.begin(), partition.levels.end()), m_points(partition.chunks.size())
{
    m_header.anchor_count = anchors;
    m_view.header = &m_header;
    m_view.params = &params;
    m_view.levels = m_levels;
}

void MetreFinder::addChunk(size_t index, const ChunkRecord& chunk, std::span<const std::byte> payload)
{
    addSurveyPoints(m_view, chunk, payload, m_points[index]);
}

Metre MetreFinder::derive(const Checkpoint& checkpoint)
{
    std::vector<dvec3> points;
    for (const std::vector<dvec3>& part : m_points)
        points.insert(points.end(), part.begin(), part.end());
    const std::vector<std::byte> cameras = cameraSection(checkpoint);
    m_view.cameras = {reinterpret_cast<const CameraRecord*>(cameras.data()), checkpoint.cameras.size()};
    const size_t names = m_view.cameras.size_bytes();
    m_view.camera_names = {reinterpret_cast<const char*>(cameras.data()) + names, cameras.size() - names};
    try {
        const ModelSurvey survey = surveyPoints(m_view, std::move(points), checkpoint.model_path);
        return {survey.site.metre, survey.metre_rule};
    } catch (const Error& e) {
        if (e.code() != ErrorCode::Unsupported)
            throw;
        // the anchors are too few, or all in one place
        return {};
    }
}

} // namespace gsc
