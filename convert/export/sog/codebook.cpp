// SPDX-License-Identifier: Apache-2.0
#include "convert/export/sog/codebook.h"

#include <gsc/interrupt.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>

namespace gsc {

namespace {

constexpr size_t kBins = 4096; // buckets of the histogram
// most steps of Lloyd's rule and of the power method; more change nothing visible
constexpr int kLloyd = 64, kPower = 3;

// First guess of a codebook: it divides the values so that all its ranges have about the same error.
Codebook equalErrors(const std::vector<float>& sorted)
{
    const double least = sorted.front(), width = (double(sorted.back()) - least) / kBins;
    std::vector<double> sums(kBins);
    for (const float value : sorted)
        sums[std::min(size_t(width > 0 ? (value - least) / width : 0), kBins - 1)] += 1;
    for (double& sum : sums)
        sum = std::cbrt(sum);
    std::partial_sum(sums.begin(), sums.end(), sums.begin());
    Codebook book;
    for (size_t i = 0; i < book.values.size(); ++i) {
        const double wanted = sums.back() * (double(i) + 0.5) / double(book.values.size());
        const auto bin = size_t(std::lower_bound(sums.begin(), sums.end(), wanted) - sums.begin());
        const double before = bin == 0 ? 0 : sums[bin - 1];
        book.values[i] = float(least + width * (double(bin) + (wanted - before) / (sums[bin] - before)));
    }
    return book;
}

// The vectors that one centre stands for: elements [first, end) of m_order.
struct Cell {
    size_t first, end;
    double error; // sum of squared differences from the mean

    bool operator<(const Cell& other) const
    {
        // equal errors are ordered by position, so that every machine gives the same order
        return error != other.error ? error < other.error : first > other.first;
    }
};

class Splitter {
public:
    Splitter(std::span<const float> vectors, size_t size)
        : m_vectors(vectors), m_size(size), m_order(vectors.size() / size), m_mean(size), m_axis(size), m_next(size)
    {
        std::iota(m_order.begin(), m_order.end(), 0u);
    }

    Palette run(size_t most)
    {
        std::priority_queue<Cell> open;
        std::vector<Cell> closed;
        open.push(cellOf(0, m_order.size()));
        while (!open.empty() && open.size() + closed.size() < most) {
            throwIfInterrupted();
            const Cell cell = open.top();
            open.pop();
            const size_t middle = cell.error > 0 ? split(cell) : cell.first;
            if (middle == cell.first || middle == cell.end) {
                closed.push_back(cell);
                continue;
            }
            open.push(cellOf(cell.first, middle));
            open.push(cellOf(middle, cell.end));
        }
        for (; !open.empty(); open.pop())
            closed.push_back(open.top());
        std::ranges::sort(closed, {}, &Cell::first); // in this order neighbouring centres are alike
        Palette palette{m_size, {}, std::vector<uint32_t>(m_order.size())};
        for (size_t i = 0; i < closed.size(); ++i) {
            (void)cellOf(closed[i].first, closed[i].end);
            palette.centers.insert(palette.centers.end(), m_mean.begin(), m_mean.end());
            for (size_t at = closed[i].first; at < closed[i].end; ++at)
                palette.labels[m_order[at]] = uint32_t(i);
        }
        return palette;
    }

private:
    [[nodiscard]] const float* vector(size_t at) const { return m_vectors.data() + m_order[at] * m_size; }

    // Makes a cell of elements [first, end) of m_order, and sets m_mean to their mean.
    Cell cellOf(size_t first, size_t end)
    {
        std::fill(m_mean.begin(), m_mean.end(), 0.0);
        double squares = 0;
        for (size_t at = first; at < end; ++at)
            for (size_t c = 0; c < m_size; ++c) {
                m_mean[c] += vector(at)[c];
                squares += double(vector(at)[c]) * vector(at)[c];
            }
        const auto count = double(end - first);
        double apart = squares;
        for (double& mean : m_mean) {
            mean /= count;
            apart -= count * mean * mean;
        }
        return {first, end, apart > 1e-12 * squares ? apart : 0};
    }

    [[nodiscard]] double along(const float* v) const // coordinate of a vector along m_axis, measured from the mean
    {
        double sum = 0;
        for (size_t c = 0; c < m_size; ++c)
            sum += (v[c] - m_mean[c]) * m_axis[c];
        return sum;
    }

    // Orders the elements of a cell along its longest axis, and returns the index at which the half above the mean
    // begins.
    size_t split(const Cell& cell)
    {
        (void)cellOf(cell.first, cell.end);
        std::fill(m_axis.begin(), m_axis.end(), 0.0);
        for (size_t at = cell.first; at < cell.end; ++at)
            for (size_t c = 0; c < m_size; ++c)
                m_axis[c] += (vector(at)[c] - m_mean[c]) * (vector(at)[c] - m_mean[c]);
        const auto widest = size_t(std::ranges::max_element(m_axis) - m_axis.begin());
        std::fill(m_axis.begin(), m_axis.end(), 0.0);
        m_axis[widest] = 1;
        // power method: turns m_axis towards the longest axis of the covariance
        for (int step = 0; step < kPower; ++step) {
            std::fill(m_next.begin(), m_next.end(), 0.0);
            for (size_t at = cell.first; at < cell.end; ++at) {
                const double weight = along(vector(at));
                for (size_t c = 0; c < m_size; ++c)
                    m_next[c] += weight * (vector(at)[c] - m_mean[c]);
            }
            double length = 0;
            for (const double v : m_next)
                length += v * v;
            if (!(length > 0))
                break;
            for (size_t c = 0; c < m_size; ++c)
                m_axis[c] = m_next[c] / std::sqrt(length);
        }
        const auto first = m_order.begin() + std::ptrdiff_t(cell.first);
        const auto second =
            std::stable_partition(first, m_order.begin() + std::ptrdiff_t(cell.end),
                                  [this](uint32_t i) { return along(m_vectors.data() + i * m_size) < 0; });
        return size_t(second - m_order.begin());
    }

    std::span<const float> m_vectors;
    size_t m_size;
    std::vector<uint32_t> m_order;
    std::vector<double> m_mean, m_axis, m_next;
};

} // namespace

uint8_t Codebook::nearest(float value) const
{
    const auto above = std::lower_bound(values.begin(), values.end(), value);
    if (above == values.begin())
        return 0;
    const auto below = above - 1;
    const bool up = above != values.end() && *above - value < value - *below;
    return uint8_t((up ? above : below) - values.begin());
}

Codebook makeCodebook(std::vector<float> numbers)
{
    std::sort(numbers.begin(), numbers.end());
    std::vector<double> sums(numbers.size() + 1);
    for (size_t i = 0; i < numbers.size(); ++i)
        sums[i + 1] = sums[i] + numbers[i];
    Codebook book = equalErrors(numbers);
    for (int step = 0; step < kLloyd; ++step) {
        size_t first = 0;
        std::array<float, 256> means = book.values;
        for (size_t i = 0; i < means.size(); ++i) {
            const auto end = i + 1 == means.size()
                                 ? numbers.end()
                                 : std::upper_bound(numbers.begin() + std::ptrdiff_t(first), numbers.end(),
                                                    (book.values[i] + book.values[i + 1]) / 2);
            const auto stop = size_t(end - numbers.begin());
            if (stop > first)
                means[i] = float((sums[stop] - sums[first]) / double(stop - first));
            first = stop;
        }
        if (means == book.values)
            break;
        book.values = means;
    }
    std::sort(book.values.begin(), book.values.end()); // rounding can swap the means of nearly equal values
    return book;
}

Palette makePalette(std::span<const float> vectors, size_t size, size_t most)
{
    return Splitter(vectors, size).run(most);
}

} // namespace gsc
