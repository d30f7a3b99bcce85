// SPDX-License-Identifier: Apache-2.0
// LPIPS on a CPU. Strips of rows of both pictures pass through a whole stage at once, so that no stage is held as a
// whole: at 1920x1080 the output of the first stage has 531 MB for one picture. A strip computes again the few rows
// around it that its neighbours compute, too.
#include "runtime/metrics/lpips.h"

#include "kernels/threads/parallel.h"
#include "runtime/metrics/convolve3x3.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gsc {

namespace {

// Shift and scale of a picture's channels, which LPIPS applies before VGG16 sees it.
constexpr float kLpipsShift[3] = {-0.030f, -0.088f, -0.188f};
constexpr float kLpipsScale[3] = {0.458f, 0.448f, 0.450f};

// Floats between pixels in memory, so that pixels of a power of two channels do not compete for the same cache lines.
constexpr size_t kPixelRoom = 16;
constexpr uint32_t kMostStripRows = 16;
constexpr uint32_t kFewestStripRows = 4;

// A whole picture, or the whole output of a stage: rows of pixels without a border.
struct FeatureMap {
    uint32_t width = 0, height = 0, channels = 0;
    std::vector<float> values;

    void resize(uint32_t w, uint32_t h, uint32_t c)
    {
        width = w;
        height = h;
        channels = c;
        values.resize(size_t(w) * h * c);
    }
    [[nodiscard]] float* row(uint32_t y) { return values.data() + size_t(y) * width * channels; }
    [[nodiscard]] const float* row(uint32_t y) const { return values.data() + size_t(y) * width * channels; }
};

// Some rows of a picture, with one column of border on the left and at least one on the right. Values outside of the
// picture are zero.
struct RowBuffer {
    int64_t first = 0; // row of the picture that is stored as row 0
    uint32_t rows = 0, channels = 0;
    size_t pixel = 0, row = 0; // distances from one pixel, and from one row, to the next, in floats
    std::vector<float> values;

    void reshape(int64_t from, uint32_t count, uint32_t width, uint32_t c)
    {
        first = from;
        rows = count;
        channels = c;
        pixel = c + kPixelRoom;
        row = (size_t(width + kConvolveTile - 1) / kConvolveTile * kConvolveTile + 2) * pixel;
        if (values.size() < count * row)
            values.resize(count * row);
    }
    // address of the border pixel on the left of row y
    [[nodiscard]] float* at(int64_t y) { return values.data() + size_t(y - first) * row; }
};

void clearOutside(RowBuffer& buffer, uint32_t width, uint32_t height)
{
    for (uint32_t i = 0; i < buffer.rows; ++i) {
        float* row = buffer.values.data() + i * buffer.row;
        const int64_t y = buffer.first + i;
        if (y < 0 || y >= int64_t(height)) {
            std::fill_n(row, buffer.row, 0.0f);
        } else {
            std::fill_n(row, buffer.pixel, 0.0f);
            std::fill(row + (width + 1) * buffer.pixel, row + buffer.row, 0.0f);
        }
    }
}

void loadRows(const FeatureMap& map, int64_t from, uint32_t count, RowBuffer& buffer)
{
    buffer.reshape(from, count, map.width, map.channels);
    clearOutside(buffer, map.width, map.height);
    for (int64_t y = std::max<int64_t>(from, 0); y < std::min<int64_t>(from + count, map.height); ++y) {
        const float* source = map.row(uint32_t(y));
        float* target = buffer.at(y) + buffer.pixel;
        for (uint32_t x = 0; x < map.width; ++x, source += map.channels, target += buffer.pixel)
            std::copy_n(source, map.channels, target);
    }
}

// Halves the size: each output is the largest of 2x2 pixels; an odd last column or row is left out. Precondition:
// `from` is even.
void poolRows(RowBuffer& rows, uint32_t from, uint32_t to, FeatureMap& pooled)
{
    for (uint32_t y = from / 2; y < to / 2; ++y) {
        const float* upper = rows.at(2 * y) + rows.pixel;
        const float* lower = upper + rows.row;
        float* out = pooled.row(y);
        for (uint32_t x = 0; x < pooled.width; ++x) {
            for (uint32_t c = 0; c < rows.channels; ++c)
                out[c] = std::max(std::max(upper[c], upper[rows.pixel + c]), std::max(lower[c], lower[rows.pixel + c]));
            upper += 2 * rows.pixel;
            lower += 2 * rows.pixel;
            out += rows.channels;
        }
    }
}

FeatureMap scaledPicture(const ImageView& image)
{
    FeatureMap map;
    map.resize(image.width, image.height, 3);
    for (size_t i = 0; i < map.values.size(); ++i)
        map.values[i] = (image.pixels[i] - kLpipsShift[i % 3]) / kLpipsScale[i % 3];
    return map;
}

bool allFinite(const ImageView& image)
{
    const float* end = image.pixels + size_t(3) * image.width * image.height;
    return std::all_of(image.pixels, end, [](float value) { return std::isfinite(value); });
}

struct Scratch {
    RowBuffer buffer[2][2]; // for each picture: the buffer that is read and the one that is written
};

} // namespace

struct Lpips::Impl {
    Impl(const LpipsWeights& weights, int threads) : workers(threads), bias(weights.bias), head(weights.head)
    {
        for (uint32_t i = 0; i < kLpipsConvolutions; ++i)
            packed[i] = packConvolution(weights.weight[i], kLpipsNet[i].in, kLpipsNet[i].out);
    }

    // Computes the rows `from` to `to` - 1 of the stage's output. Returns the one of the two buffers that holds them.
    RowBuffer& passStage(uint32_t stage, const FeatureMap& in, uint32_t from, uint32_t to, RowBuffer (&buffer)[2]) const
    {
        const auto in_stage = [stage](const LpipsConvolution& convolution) { return convolution.stage == stage; };
        const auto begin = std::find_if(kLpipsNet.begin(), kLpipsNet.end(), in_stage);
        const auto end = std::find_if_not(begin, kLpipsNet.end(), in_stage);
        uint32_t around = uint32_t(end - begin); // rows that the remaining convolutions need on each side
        uint32_t source = 0;
        loadRows(in, int64_t(from) - around, to - from + 2 * around, buffer[source]);
        for (auto convolution = begin; convolution != end; ++convolution) {
            --around;
            RowBuffer& read = buffer[source];
            RowBuffer& written = buffer[1 - source];
            written.reshape(int64_t(from) - around, to - from + 2 * around, in.width, convolution->out);
            const int64_t first = std::max<int64_t>(written.first, 0);
            const int64_t last = std::min<int64_t>(written.first + written.rows, in.height);
            const size_t number = size_t(convolution - kLpipsNet.begin());
            convolve3x3({.in = read.at(first - 1),
                         .in_pixel = read.pixel,
                         .in_row = read.row,
                         .in_channels = convolution->in,
                         .weight = packed[number].data(),
                         .bias = bias[number].data(),
                         .out = written.at(first) + written.pixel,
                         .out_pixel = written.pixel,
                         .out_row = written.row,
                         .out_channels = convolution->out,
                         .rows = uint32_t(last - first),
                         .tiles = (in.width + kConvolveTile - 1) / kConvolveTile});
            clearOutside(written, in.width, in.height);
            source = 1 - source;
        }
        return buffer[source];
    }

    // Runs a stage on both pictures and returns the sum of the distances of its pixels. `map` becomes the input of the
    // next stage.
    double runStage(uint32_t stage, FeatureMap (&map)[2], std::vector<Scratch>& scratch,
                    const LpipsObserver& observer) const
    {
        const uint32_t width = map[0].width, height = map[0].height, channels = kLpipsChannels[stage];
        FeatureMap pooled[2];
        if (stage + 1 < kLpipsStages)
            for (FeatureMap& next : pooled)
                next.resize(width / 2, height / 2, channels);
        // even, so that no 2x2 pixels lie in two strips
        const uint32_t share = (height / uint32_t(2 * workers.count()) + 1) & ~1u;
        const uint32_t strip = std::clamp(share, kFewestStripRows, kMostStripRows);
        // added in the order of rows, so that the result does not depend on the threads
        std::vector<double> row_sums(height);
        workers.run((height + strip - 1) / strip, 1, [&](size_t begin, size_t end, int worker) {
            for (size_t i = begin; i < end; ++i) {
                const uint32_t from = uint32_t(i) * strip, to = std::min(from + strip, height);
                RowBuffer* rows[2];
                for (uint32_t image = 0; image < 2; ++image) {
                    rows[image] = &passStage(stage, map[image], from, to, scratch[size_t(worker)].buffer[image]);
                    if (observer)
                        observer({stage, image, from, to - from, width, channels,
                                  rows[image]->at(from) + rows[image]->pixel, rows[image]->pixel, rows[image]->row});
                    if (stage + 1 < kLpipsStages)
                        poolRows(*rows[image], from, to, pooled[image]);
                }
                const size_t pixel = rows[0]->pixel;
                for (uint32_t y = from; y < to; ++y)
                    row_sums[y] = unitDistance(rows[0]->at(y) + pixel, rows[1]->at(y) + pixel, pixel, width, channels,
                                               head[stage].data());
            }
        });
        map[0] = std::move(pooled[0]);
        map[1] = std::move(pooled[1]);
        double total = 0;
        for (const double sum : row_sums)
            total += sum;
        return total;
    }

    Workers workers;
    std::array<std::vector<float>, kLpipsConvolutions> packed, bias;
    std::array<std::vector<float>, kLpipsStages> head;
};

Lpips::Lpips(const LpipsWeights& weights, int threads) : m_impl(std::make_unique<Impl>(weights, threads)) {}

Lpips::~Lpips() = default;

LpipsDistance Lpips::distance(const ImageView& a, const ImageView& b, const LpipsObserver& observer) const
{
    LpipsDistance result;
    if (!allFinite(a) || !allFinite(b)) {
        result.total = std::numeric_limits<double>::quiet_NaN();
        result.stage.fill(result.total);
        return result;
    }
    FeatureMap map[2] = {scaledPicture(a), scaledPicture(b)};
    std::vector<Scratch> scratch(size_t(m_impl->workers.count()));
    for (uint32_t stage = 0; stage < kLpipsStages; ++stage) {
        const double pixels = double(map[0].width) * map[0].height;
        result.stage[stage] = m_impl->runStage(stage, map, scratch, observer) / pixels;
        result.total += result.stage[stage];
    }
    return result;
}

} // namespace gsc
