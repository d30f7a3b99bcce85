// SPDX-License-Identifier: Apache-2.0
#include "player/xr/lens_mask.h"

#include <gsc/error.h>
#include "format/numbers/count_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace gsc {

namespace {

constexpr size_t kMostTriangles = 2048; // most triangles of a mesh; real headsets have some hundred

struct Point {
    double x, y; // place in pixels from the top left corner, right and down
};

// Pixels of a row from `first` up to but not including `end`.
struct Span {
    int64_t first, end;
};

bool isView(const SpaceEye& eye)
{
    constexpr double kMost = std::numbers::pi / 2;
    const auto inside = [](double angle) { return angle > -kMost && angle < kMost; }; // also false for NaN
    return inside(eye.left) && inside(eye.right) && inside(eye.up) && inside(eye.down) && eye.left < eye.right &&
           eye.down < eye.up;
}

uint32_t squaresOf(uint32_t pixels)
{
    return (pixels + kLensSquare - 1) / kLensSquare;
}

// A mesh of hidden triangles in pixels of the picture. Computes the hidden pixels row by row.
class HiddenRows {
public:
    HiddenRows(const HiddenMesh& mesh, const SpaceEye& eye, uint32_t width, uint32_t height)
        : m_indices(mesh.indices), m_width(width)
    {
        const double left = std::tan(eye.left), up = std::tan(eye.up);
        const double across = width / (std::tan(eye.right) - left), along = height / (up - std::tan(eye.down));
        for (const auto& [right, above] : mesh.vertices)
            m_points.push_back({(double(right) - left) * across, (up - double(above)) * along});
    }

    // Selects the triangles that reach the rows first_row to end_row, which row() is called for next.
    void look(int64_t first_row, int64_t end_row)
    {
        m_near.clear();
        for (size_t i = 0; i < m_indices.size(); i += 3) {
            const std::array<Point, 3> corners = {m_points[m_indices[i]], m_points[m_indices[i + 1]],
                                                  m_points[m_indices[i + 2]]};
            const auto [low, high] = std::ranges::minmax(corners, {}, &Point::y);
            if (low.y <= double(end_row) && high.y >= double(first_row))
                m_near.push_back(corners);
        }
    }

    // Returns the hidden pixels of a row as spans, in order and with pixels between them.
    [[nodiscard]] std::vector<Span> row(uint32_t row) const
    {
        std::vector<Span> spans;
        for (const std::array<Point, 3>& corners : m_near)
            add(corners, row + 0.5, spans);
        std::ranges::sort(spans, {}, &Span::first);
        std::vector<Span> merged;
        for (const Span& span : spans)
            if (merged.empty() || merged.back().end < span.first)
                merged.push_back(span);
            else
                merged.back().end = std::max(merged.back().end, span.end);
        return merged;
    }

private:
    // x of the edge from `a` to `b` at height y. Two triangles with a common edge get equal bits, so that no pixel
    // between them is lost.
    [[nodiscard]] static double at(Point a, Point b, double y)
    {
        if (std::pair(b.y, b.x) < std::pair(a.y, a.x))
            std::swap(a, b);
        return a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
    }

    void add(const std::array<Point, 3>& corners, double y, std::vector<Span>& spans) const
    {
        double from = HUGE_VAL, to = -HUGE_VAL;
        for (size_t i = 0; i < 3; ++i) {
            const Point &p = corners[i], &q = corners[(i + 1) % 3];
            if (p.y == q.y || y < std::min(p.y, q.y) || y > std::max(p.y, q.y))
                continue;
            const double x = at(p, q, y);
            from = std::min(from, x);
            to = std::max(to, x);
        }
        if (!(from <= to)) // the triangle does not reach this row
            return;
        const Span span{int64_t(std::clamp(std::ceil(from - 0.5), 0.0, double(m_width))),
                        int64_t(std::clamp(std::floor(to - 0.5) + 1, 0.0, double(m_width)))};
        if (span.first < span.end)
            spans.push_back(span);
    }

    const std::vector<uint32_t>& m_indices;
    uint32_t m_width;
    std::vector<Point> m_points;
    std::vector<std::array<Point, 3>> m_near;
};

} // namespace

std::string meshFault(const HiddenMesh& mesh)
{
    if (!mesh.fault.empty())
        return mesh.fault;
    if (mesh.indices.size() % 3 != 0)
        return "has " + formatCount(mesh.indices.size(), "index", "indices") + ", expected three of each triangle";
    if (mesh.indices.size() / 3 > kMostTriangles) // the frame loop waits for it
        return formatString("has %zu triangles, expected at most %zu", mesh.indices.size() / 3, kMostTriangles);
    for (const uint32_t index : mesh.indices)
        if (index >= mesh.vertices.size())
            return formatString("has an index of %u, expected one of %s", index,
                                formatCount(mesh.vertices.size(), "corner").c_str());
    for (const auto& [right, up] : mesh.vertices)
        if (!std::isfinite(right) || !std::isfinite(up))
            return formatString("has a corner at %g, %g, expected finite numbers", double(right), double(up));
    return {};
}

LensShape lensShape(const HiddenMesh& mesh, const SpaceEye& eye, uint32_t width, uint32_t height)
{
    const uint32_t columns = squaresOf(width), rows = std::min(squaresOf(height), kLensRows);
    if (mesh.indices.empty() || !meshFault(mesh).empty() || !isView(eye) || columns == 0 || columns > 255)
        return {};
    HiddenRows hidden(mesh, eye, width, height);
    LensShape lens;
    std::ranges::fill(lens.end, uint8_t(columns));
    bool shows = height > kLensRows * kLensSquare;
    for (uint32_t r = 0; r < rows; ++r) {
        std::vector<uint8_t> seen(columns, 0);
        const int64_t first_row = std::max<int64_t>(int64_t(r) * kLensSquare - kLensMargin, 0),
                      end_row = std::min<int64_t>(int64_t(r + 1) * kLensSquare + kLensMargin, height);
        hidden.look(first_row, end_row);
        for (int64_t y = first_row; y < end_row; ++y) {
            const std::vector<Span> spans = hidden.row(uint32_t(y));
            for (uint32_t c = 0; c < columns; ++c) {
                const int64_t first = std::max<int64_t>(int64_t(c) * kLensSquare - kLensMargin, 0),
                              end = std::min<int64_t>(int64_t(c + 1) * kLensSquare + kLensMargin, width);
                seen[c] = seen[c] != 0 || std::ranges::none_of(spans, [&](const Span& span) {
                              return span.first <= first && end <= span.end;
                          });
            }
        }
        const auto from = std::ranges::find(seen, 1);
        lens.first[r] = uint8_t(from == seen.end() ? 0 : from - seen.begin());
        lens.end[r] = uint8_t(seen.rend() - std::find(seen.rbegin(), seen.rend(), 1));
        lens.masks = lens.masks || lens.first[r] != 0 || lens.end[r] != columns;
        shows = shows || lens.first[r] < lens.end[r];
    }
    return lens.masks && shows ? lens : LensShape{};
}

double hiddenShare(const LensShape& lens, uint32_t width, uint32_t height)
{
    if (!lens.masks || width == 0 || height == 0)
        return 0;
    uint64_t hidden = 0;
    for (uint32_t r = 0; r < std::min(squaresOf(height), kLensRows); ++r) {
        const uint64_t high = std::min(kLensSquare, height - r * kLensSquare);
        const uint64_t first = std::min(lens.first[r] * kLensSquare, width),
                       end = std::clamp(lens.end[r] * kLensSquare, uint32_t(first), width);
        hidden += high * (width - (end - first));
    }
    return double(hidden) / (double(width) * height);
}

} // namespace gsc
