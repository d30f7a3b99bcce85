// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_fit.h"

#include "convert/export/symmetric.h"
#include <gsc/error.h>
#include "format/machine/machine.h"
#include "kernels/decode/decode.h"
#include "kernels/select/select.h"
#include "kernels/threads/parallel.h"

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr uint64_t kRangeBytes = 1u << 30; // most bytes for the sums of anchors that are fitted together
// Gaussians that the caller gets at once; they take 16 MiB at degree 3
constexpr size_t kPartGaussians = 1u << 16;
// Pulls colour coefficients towards zero, so that those which the cameras' directions leave open stay small. It is a
// share of the weight of the Gaussian and grows with the square of the degree.
constexpr double kRidge = 1e-3;
// Each view also counts anchors beside its picture, up to this many times its width and height, with the weight
// kBesideWeight: networks answer for any direction, and these answers serve anchors that no picture shows.
constexpr float kBeside = 3;
constexpr float kBesideWeight = 0.1f;
// least axis of a Gaussian as a share of its longest; sums of floats are too inexact for thinner ones
constexpr double kThinnest = 1e-4;
// How far the volume of a Gaussian is taken from that of the mean covariance to the geometric mean of its volumes. On
// trained models 0.5 gives up to 1.2 dB more than 0, and more than 1 does.
constexpr double kVolumeShare = 0.5;

// The eye with a picture kBeside times as wide and as high, from the same place.
EyeParams widened(EyeParams eye)
{
    eye.width = uint32_t(kBeside * float(eye.width));
    eye.height = uint32_t(kBeside * float(eye.height));
    eye.tan_fov_x *= kBeside;
    eye.tan_fov_y *= kBeside;
    for (size_t i = 0; i < 8; ++i) // rows 0 and 1 of the projection, for x and y
        eye.full_projection[i] /= kBeside;
    return eye;
}

float weightAt(const EyeParams& eye, const Vec3<float>& p)
{
    const Vec3<float> t = viewPoint<float>(eye, p);
    const bool shown = std::abs(t.x - eye.tan_mid_x * t.z) <= eye.tan_fov_x * t.z &&
                       std::abs(t.y - eye.tan_mid_y * t.z) <= eye.tan_fov_y * t.z;
    return shown ? 1.0f : kBesideWeight;
}

bool hasLevels(const ModelView& model)
{
    return (model.params->flags & kModelHasLevels) && model.params->level_rule != uint32_t(LevelRule::None);
}

// Layout of the floats that are kept for each Gaussian, all summed over the views that show it. The matrix of the
// equations for its colours comes first.
struct SumLayout {
    // coefficients of a colour channel; elements of the matrix, of which the lower triangle is kept
    size_t n, triangle;
    // indices of the other sums; number of all floats
    size_t rhs, weight, opacity, covariance, position, score, volume, count;

    explicit SumLayout(int degree)
        : n(shValues(degree)), triangle(n * (n + 1) / 2), rhs(triangle), weight(rhs + 3 * n), opacity(weight + 1),
          covariance(opacity + 1), position(covariance + 6), score(position + 3), volume(score + 1), count(volume + 1)
    {
    }
};

void addCovariance(const float* scale, const float* q, double weight, float* sum)
{
    glm::dmat3 axes = glm::mat3_cast(glm::dquat(q[0], q[1], q[2], q[3]));
    for (int i = 0; i < 3; ++i)
        axes[i] *= double(scale[i]);
    const glm::dmat3 covariance = axes * transpose(axes);
    for (int i = 0, at = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j)
            sum[at++] += float(weight * covariance[i][j]);
}

// Logarithm of the product of three axes, shortest first, as far as the axes of the fit may be apart.
float logVolume(const float* axes)
{
    const double longest = std::max(double(axes[2]), 1e-12), least = longest * kThinnest;
    return float(std::log(longest * std::max(double(axes[1]), least) * std::max(double(axes[0]), least)));
}

class Fitter {
public:
    Fitter(const ModelView& model, std::span<const FitView> views, const FitOptions& options)
        : m_model(model), m_views(views), m_options(options), m_layout(options.degree), m_workers(options.threads),
          m_scratch(size_t(m_workers.count())), m_all_params(*model.params), m_all_levels(model),
          m_by_level(!options.as_seen && hasLevels(model))
    {
        m_all_params.level_rule = uint32_t(LevelRule::None);
        m_all_levels.params = &m_all_params;
        for (DecodeScratch& scratch : m_scratch)
            reserveDecode(model, scratch);
    }

    void run(const GaussianSink& take, const std::function<void(uint64_t, uint64_t)>& progress)
    {
        const ChunkRecord& last = m_model.chunks[m_model.params->chunk_count - 1];
        const uint64_t K = m_model.params->n_offsets, anchors = last.anchor_first + last.anchor_count;
        const uint64_t memory = usableMemory(), bytes = memory > 0 ? std::min(kRangeBytes, memory / 8) : kRangeBytes;
        const uint64_t each = std::max<uint64_t>(bytes / (K * m_layout.count * sizeof(float)), kDecodeBlock);
        const uint64_t ranges = (anchors + each - 1) / each;
        for (uint64_t r = 0; r < ranges; ++r) {
            const uint64_t first = r * each, end = std::min(first + each, anchors);
            m_sums.assign((end - first) * K * m_layout.count, 0.0f);
            m_seen.assign(end - first, 0.0f);
            m_met.assign(m_by_level ? end - first : 0, 0.0f);
            for (size_t v = 0; v < m_views.size(); ++v) {
                progress(r * m_views.size() + v, ranges * m_views.size());
                addView(m_views[v], first, end);
            }
            giveRange(first, end, take);
        }
    }

private:
    [[nodiscard]] uint64_t anchorOf(const VisibleAnchor& visible) const
    {
        return m_model.chunks[visible.chunk].anchor_first + visible.local;
    }

    // Anchors from `first` to `end` that the eye sees of `model`.
    std::span<const VisibleAnchor> select(const ModelView& model, const EyeParams& eye, uint64_t first, uint64_t end)
    {
        SelectCounts counts{};
        const size_t all = selectCpu({&model, &eye, 1, m_options.rules, 0, 0}, m_workers, m_select, m_visible, counts);
        // they are in the order of the file
        const auto before = [this](uint64_t anchor) {
            return [this, anchor](const VisibleAnchor& visible) { return anchorOf(visible) < anchor; };
        };
        const VisibleAnchor* const visible = m_visible.data();
        const VisibleAnchor* const from = std::partition_point(visible, visible + all, before(first));
        return {from, std::partition_point(from, visible + all, before(end))};
    }

    void addView(const FitView& view, uint64_t first, uint64_t end)
    {
        const EyeParams wide = m_options.as_seen ? view.eye : widened(view.eye);
        if (m_by_level)
            for (const VisibleAnchor& anchor : select(m_all_levels, wide, first, end))
                m_met[anchorOf(anchor) - first] += weightOf(anchor, view.eye);
        const std::span<const VisibleAnchor> anchors = select(m_model, wide, first, end);
        const size_t count = anchors.size();
        const DecodeArgs args = prepareDecode(m_model, &view.eye, 1, anchors.data(), count, view.appearance, m_bias);
        m_workers.run((count + kDecodeBlock - 1) / kDecodeBlock, 1, [&](size_t begin, size_t stop, int worker) {
            for (size_t b = begin; b < stop; ++b)
                addBlock(args, b * kDecodeBlock, std::min<size_t>(kDecodeBlock, count - b * kDecodeBlock), first,
                         view.eye, m_scratch[size_t(worker)]);
        });
    }

    [[nodiscard]] float weightOf(const VisibleAnchor& anchor, const EyeParams& eye) const
    {
        return m_options.as_seen ? 1 : weightAt(eye, anchorPosition(m_model, anchor.chunk, anchor.local));
    }

    void addBlock(const DecodeArgs& args, size_t at, size_t count, uint64_t first, const EyeParams& eye,
                  DecodeScratch& scratch)
    {
        decodeBlockCpu(args, at, uint32_t(count), scratch);
        const GaussianBlock& block = scratch.blocks[0];
        const uint32_t K = m_model.params->n_offsets;
        float weights[kDecodeBlock];
        for (size_t i = 0; i < count; ++i) {
            const VisibleAnchor& visible = args.visible[at + i];
            weights[i] = weightOf(visible, eye);
            m_seen[anchorOf(visible) - first] += weights[i];
        }
        for (uint32_t g = 0; g < block.count; ++g) {
            const uint64_t anchor = anchorOf(args.visible[at + block.origin[g] / K]) - first;
            add(block, g, eye, weights[block.origin[g] / K],
                m_sums.data() + (anchor * K + block.origin[g] % K) * m_layout.count);
        }
    }

    void add(const GaussianBlock& block, uint32_t g, const EyeParams& eye, float seen, float* sums) const
    {
        float direction[3], distance = 0, position[3], scale[3], rotation[4];
        for (size_t i = 0; i < 3; ++i) {
            position[i] = block.position[i][g];
            scale[i] = block.scale[i][g];
            direction[i] = position[i] - eye.center[i];
            distance += direction[i] * direction[i];
        }
        distance = std::sqrt(distance);
        float finite = block.opacity[g] + distance;
        for (size_t i = 0; i < 4; ++i)
            finite += rotation[i] = block.rotation[i][g];
        finite += scale[0] + scale[1] + scale[2] + block.color[0][g] + block.color[1][g] + block.color[2][g];
        if (!std::isfinite(finite) || !(distance > 0)) // the trainers' rasteriser draws nothing of such a Gaussian
            return;
        for (float& d : direction)
            d /= distance;
        const float opacity = block.opacity[g];
        const float weight = seen * opacity / (distance * distance); // a Gaussian covers more of a near picture
        float basis[kMostShValues];
        shBasis(m_options.degree, direction, basis);
        size_t at = 0;
        for (size_t i = 0; i < m_layout.n; ++i) {
            for (size_t j = 0; j <= i; ++j)
                sums[at++] += weight * basis[i] * basis[j];
            for (size_t c = 0; c < 3; ++c)
                sums[m_layout.rhs + 3 * i + c] += weight * basis[i] * (block.color[c][g] - 0.5f);
        }
        sums[m_layout.weight] += weight;
        sums[m_layout.opacity] += seen * opacity;
        addCovariance(scale, rotation, weight, sums + m_layout.covariance);
        std::copy_n(position, 3, sums + m_layout.position); // equal in every view
        std::sort(scale, scale + 3);
        sums[m_layout.volume] += weight * logVolume(scale);
        const float focal = eye.focal_x / distance;
        const float area = (scale[2] * focal + 0.55f) * (scale[1] * focal + 0.55f);
        sums[m_layout.score] += seen * opacity * std::min(area, float(eye.width) * float(eye.height));
    }

    void giveRange(uint64_t first, uint64_t end, const GaussianSink& take) const
    {
        GaussianSet set;
        set.degree = m_options.degree;
        const uint64_t K = m_model.params->n_offsets;
        const ChunkRecord* chunk = m_model.chunks;
        for (uint64_t a = first; a < end; ++a) {
            while (a >= uint64_t(chunk->anchor_first) + chunk->anchor_count)
                ++chunk;
            for (uint64_t k = 0; k < K; ++k) {
                const float* sums = m_sums.data() + ((a - first) * K + k) * m_layout.count;
                if (sums[m_layout.weight] > 0)
                    appendOne(sums, m_seen[a - first], set);
            }
            set.shown.resize(set.size(), m_by_level ? m_seen[a - first] / m_met[a - first] : 1.0f);
            set.level.resize(set.size(), uint16_t(chunk->level_index));
            if (set.size() >= kPartGaussians || a + 1 == end) {
                take(std::move(set));
                set = {};
                set.degree = m_options.degree;
            }
        }
    }

    void appendOne(const float* sums, float seen, GaussianSet& set) const
    {
        const size_t n = m_layout.n;
        const double weight = sums[m_layout.weight];
        double matrix[kMostShValues * (kMostShValues + 1) / 2], color[3 * kMostShValues] = {};
        std::copy_n(sums, m_layout.triangle, matrix);
        std::copy_n(sums + m_layout.rhs, 3 * n, color);
        for (size_t i = 1; i < n; ++i) {
            const auto degree = double(i < 4 ? 1 : i < 9 ? 2 : 3);
            matrix[i * (i + 1) / 2 + i] += kRidge * degree * degree * weight;
        }
        if (!solveSymmetric(matrix, color, n, 3)) // the weight is too small to solve the equations
            return;
        double covariance[6], rotation[4], deviation[3], finite = sums[m_layout.score];
        for (size_t i = 0; i < 6; ++i)
            finite += covariance[i] = sums[m_layout.covariance + i] / weight;
        for (const double value : color)
            finite += value;
        const float opacity = std::min(sums[m_layout.opacity] / seen, 1.0f);
        // too transparent, or not finite: nothing of it would be drawn
        if (!(opacity >= kOpacityFloor) || !std::isfinite(finite))
            return;
        ellipsoidAxes(covariance, rotation, deviation);
        const double least = std::max({deviation[0], deviation[1], deviation[2], 1e-12}) * kThinnest;
        double log_scale[3], log_volume = 0;
        for (size_t i = 0; i < 3; ++i)
            log_volume += log_scale[i] = std::log(std::max(deviation[i], least));
        // a mean of covariances that lie in different directions is larger than any of them
        const double smaller = m_options.as_seen ? 0 : kVolumeShare / 3 * (sums[m_layout.volume] / weight - log_volume);
        for (size_t i = 0; i < 3; ++i) {
            set.position.push_back(float(sums[m_layout.position + i] + m_model.origin[i]));
            set.log_scale.push_back(float(log_scale[i] + smaller));
        }
        for (const double q : rotation)
            set.rotation.push_back(float(q));
        // mean over the views of its anchor; views that do not show the Gaussian count as 0
        set.opacity.push_back(opacity);
        for (size_t i = 0; i < 3 * shValues(m_options.degree); ++i)
            set.color.push_back(float(color[i]));
        set.score.push_back(sums[m_layout.score]);
    }

    const ModelView& m_model;
    std::span<const FitView> m_views;
    FitOptions m_options;
    SumLayout m_layout;
    Workers m_workers;
    std::vector<DecodeScratch> m_scratch;
    SelectScratch m_select;
    Buffer<VisibleAnchor> m_visible;
    Buffer<float> m_bias;
    ModelParams m_all_params; // those of a model that shows every level at any distance
    ModelView m_all_levels;
    bool m_by_level;
    std::vector<float> m_seen; // per anchor of the range: sum of the weights of the views that show it
    std::vector<float> m_met;  // with levels, the same sum for the views that would show it if it were coarse enough
    std::vector<float> m_sums; // SumLayout::count sums for each Gaussian of the range
};

} // namespace

void fitGaussians(const ModelView& model, std::span<const FitView> views, const FitOptions& options,
                  const GaussianSink& take, const std::function<void(uint64_t, uint64_t)>& progress)
{
    Fitter(model, views, options).run(take, progress);
}

} // namespace gsc
