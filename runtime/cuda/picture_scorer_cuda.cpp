// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/picture_scorer_cuda.h"

#include "kernels/metrics/scores_cuda.h"
#include "runtime/cuda/device/cuda_device.h"
#include "runtime/cuda/device/device_buffer.h"
#include "runtime/metrics/filter_weights.h"
#include "runtime/metrics/metrics.h"

#include <algorithm>
#include <vector>

namespace gsc {

namespace {

FilterWeights weightsOf(const std::vector<double>& kernel)
{
    FilterWeights weights{};
    weights.radius = int32_t(kernel.size() / 2);
    std::ranges::copy(kernel, weights.weight);
    return weights;
}

class CudaScorer final : public PictureScorer {
public:
    explicit CudaScorer(int ordinal) : m_device(ordinal) {}
    // makes the device current again, because the members then free memory on it
    ~CudaScorer() override { (void)cudaSetDevice(m_device.ordinal()); }

    PictureScores score(uint32_t eye, const PictureRef& image, const PictureRef& exact,
                        const ScoreRequest& request) override
    {
        m_device.use();
        makeRoom(eye, image.width, image.height, request);
        const PicturePair pair{onDevice(image, 0), onDevice(exact, 1), image.width, image.height};
        ScoreGaze gaze{};
        if (request.gaze != nullptr)
            gaze = {*request.gaze, true};
        Eye& own = m_eyes[eye];
        squareSumsCuda({pair, gaze, own.last_error, own.last_image, m_room.squares}, m_stream.handle);
        PictureScores scores;
        own.history.add(fetched(m_room.squares, m_square_sums), pair.width, pair.height, scores);
        if (request.ssim)
            scores.ssim = ssimOf(pair);
        if (request.flip)
            scoreFlip(pair, gaze, scores);
        return scores;
    }

    void forget() override
    {
        for (Eye& eye : m_eyes)
            eye.history.forget();
    }

private:
    struct Eye {
        explicit Eye(MemoryBudget& budget) : memory(budget) {}
        SquareHistory history;
        DeviceArena memory;
        uint32_t width = 0, height = 0;
        float *last_error = nullptr, *last_image = nullptr;
    };
    struct Room {              // memory that all eyes use in turn
        float* copies[2] = {}; // copies of pictures that came from the host
        SquareSums* squares = nullptr;
        double* square_values = nullptr;
        SquareFlip* square_flips = nullptr;
        float* planes[2][3] = {}; // three planes in opponent colours, of the picture and of the exact one
        FlipFeatures* features[2] = {};
        float* scratch[5] = {};
    };

    // Makes room for pictures of this size. If the size changes, the state of earlier pictures is lost, which does no
    // harm: they cannot be compared with these.
    void makeRoom(uint32_t eye, uint32_t width, uint32_t height, const ScoreRequest& request)
    {
        const size_t pixels = size_t(width) * height;
        m_square_count = size_t(squaresAlong(width)) * squaresAlong(height);
        Eye& own = m_eyes[eye];
        if (own.width != width || own.height != height)
            layOutIn(own.memory, "scores of pictures", [&](ArenaLayout& layout) {
                own.last_error = layout.take<float>(3 * pixels);
                own.last_image = layout.take<float>(3 * pixels);
            });
        own.width = width;
        own.height = height;
        // once needed, the memory is kept, so that it is not allocated again and again
        m_with_ssim = m_with_ssim || request.ssim;
        m_with_flip = m_with_flip || request.flip;
        m_room = layOutIn(m_memory, "scores of pictures", [&](ArenaLayout& layout) {
            Room room;
            for (float*& copy : room.copies)
                copy = layout.take<float>(3 * pixels);
            room.squares = layout.take<SquareSums>(m_square_count);
            for (size_t i = 0; i < (m_with_ssim ? 5u : m_with_flip ? 3u : 0u); ++i)
                room.scratch[i] = layout.take<float>(pixels);
            if (m_with_ssim)
                room.square_values = layout.take<double>(m_square_count);
            if (m_with_flip) {
                for (auto& picture : room.planes)
                    for (float*& plane : picture)
                        plane = layout.take<float>(pixels);
                for (FlipFeatures*& features : room.features)
                    features = layout.take<FlipFeatures>(pixels);
                room.square_flips = layout.take<SquareFlip>(m_square_count);
            }
            return room;
        });
    }

    const float* onDevice(const PictureRef& picture, size_t slot)
    {
        if (picture.on_device)
            return picture.pixels;
        GSC_CUDA_CHECK(cudaMemcpyAsync(m_room.copies[slot], picture.pixels,
                                       size_t(picture.width) * picture.height * 3 * sizeof(float),
                                       cudaMemcpyHostToDevice, m_stream.handle));
        return m_room.copies[slot];
    }

    // Returns one value for each square, after waiting for the kernels that write them.
    template <typename T>
    const std::vector<T>& fetched(const T* squares, std::vector<T>& into)
    {
        into.resize(m_square_count);
        GSC_CUDA_CHECK(
            cudaMemcpyAsync(into.data(), squares, m_square_count * sizeof(T), cudaMemcpyDeviceToHost, m_stream.handle));
        GSC_CUDA_CHECK(cudaStreamSynchronize(m_stream.handle));
        return into;
    }

    double ssimOf(const PicturePair& pair)
    {
        SsimCudaArgs args{};
        args.pair = pair;
        args.window = weightsOf(ssimWindow());
        std::ranges::copy(m_room.scratch, args.planes);
        args.squares = m_room.square_values;
        double sum = 0;
        for (args.channel = 0; args.channel < 3; ++args.channel) {
            ssimCuda(args, m_stream.handle);
            for (const double square : fetched(m_room.square_values, m_square_values))
                sum += square;
        }
        const double values = 3.0 * pair.width * pair.height;
        return values > 0 ? sum / values : 1;
    }

    void filterSensitivity(const PicturePair& pair, uint32_t channel, float* plane)
    {
        RowFilterCudaArgs rows{plane, pair.width, pair.height, 0, false, {}, {}};
        ColumnFilterCudaArgs columns{pair.width, pair.height, 0, {}, {}, {}, plane};
        for (const SensitivityTerm& term : sensitivityTerms(channel, kFlipPixelsPerDegree)) {
            const uint32_t i = rows.count++;
            rows.filters[i] = columns.filters[i] = weightsOf(term.kernel);
            rows.out[i] = m_room.scratch[i];
            columns.planes[i] = m_room.scratch[i];
            columns.shares[i] = term.share;
        }
        columns.count = rows.count;
        filterRowsCuda(rows, m_stream.handle);
        filterColumnsCuda(columns, m_stream.handle);
    }

    // Computes what FLIP needs of one picture; features are computed from the planes before these are filtered.
    void prepareFlip(const PicturePair& pair, size_t which)
    {
        float* const* const planes = m_room.planes[which];
        OpponentCudaArgs opponent{which == 0 ? pair.image : pair.exact, pair.width, pair.height, {}};
        std::copy_n(planes, 3, opponent.planes);
        opponentCuda(opponent, m_stream.handle);
        const FeatureFilters filters = featureFilters(kFlipPixelsPerDegree);
        const FilterWeights blur = weightsOf(filters.blur), first = weightsOf(filters.first),
                            second = weightsOf(filters.second);
        float* const* const scratch = m_room.scratch;
        filterRowsCuda(
            {planes[0], pair.width, pair.height, 3, true, {blur, first, second}, {scratch[0], scratch[1], scratch[2]}},
            m_stream.handle);
        flipFeaturesCuda(
            {pair.width, pair.height, scratch[0], scratch[1], scratch[2], blur, first, second, m_room.features[which]},
            m_stream.handle);
        for (uint32_t channel = 0; channel < 3; ++channel)
            filterSensitivity(pair, channel, planes[channel]);
    }

    void scoreFlip(const PicturePair& pair, const ScoreGaze& gaze, PictureScores& scores)
    {
        prepareFlip(pair, 0);
        prepareFlip(pair, 1);
        FlipCudaArgs args{};
        args.width = pair.width;
        args.height = pair.height;
        std::copy_n(m_room.planes[0], 3, args.image);
        std::copy_n(m_room.planes[1], 3, args.exact);
        args.image_features = m_room.features[0];
        args.exact_features = m_room.features[1];
        args.largest = largestFlipColor();
        args.gaze = gaze;
        args.squares = m_room.square_flips;
        flipSquaresCuda(args, m_stream.handle);
        double sums[2] = {};
        for (const SquareFlip& square : fetched(m_room.square_flips, m_square_flips))
            for (size_t part = 0; part < 2; ++part)
                sums[part] += square.error[part];
        const double pixels = double(pair.width) * pair.height;
        scores.flip = pixels > 0 ? (sums[0] + sums[1]) / pixels : 0;
        for (size_t part = 0; part < 2 && gaze.present; ++part)
            scores.fovea[part].flip = sums[part];
    }

    CudaDevice m_device; // declared first, because the members below hold memory of it
    MemoryBudget m_budget;
    CudaStream m_stream;
    Eye m_eyes[kMaxEyes] = {Eye(m_budget), Eye(m_budget)};
    DeviceArena m_memory{m_budget};
    Room m_room;
    bool m_with_ssim = false, m_with_flip = false;
    size_t m_square_count = 0;
    std::vector<SquareSums> m_square_sums;
    std::vector<double> m_square_values;
    std::vector<SquareFlip> m_square_flips;
};

} // namespace

std::unique_ptr<PictureScorer> makeCudaScorer(int ordinal)
{
    return std::make_unique<CudaScorer>(ordinal);
}

uint64_t freeCudaBytes(int ordinal)
{
    const CudaDevice device(ordinal);
    size_t left = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&left, &total));
    return left;
}

} // namespace gsc
