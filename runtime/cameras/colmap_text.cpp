// SPDX-License-Identifier: Apache-2.0
// cameras.txt and images.txt, as COLMAP writes them and as others do.
#include <gsc/error.h>
#include "runtime/cameras/colmap_model.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>

namespace gsc {

namespace {

constexpr std::string_view kBlank = " \t\r\v\f";
constexpr size_t kSurelyPoints = 60;  // words of such triples, the rest of whose line is not looked at
constexpr double kSquareError = 0.02; // of the square of a quaternion's length

std::string_view trimmed(std::string_view text)
{
    const size_t first = text.find_first_not_of(kBlank);
    return first == std::string_view::npos ? std::string_view()
                                           : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// The lines of a text that starts with a byte order mark or does not; ended by LF, CR LF or CR alone. Several CR before LF
// are one end, as a program leaves them that turned LF into CR LF once more.
class TextLines {
public:
    explicit TextLines(std::string_view text) : m_rest(text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text) {}

    bool next(std::string_view& line)
    {
        if (m_rest.empty())
            return false;
        const size_t end = std::min(m_rest.find_first_of("\r\n"), m_rest.size());
        line = trimmed(m_rest.substr(0, end));
        const size_t behind = m_rest.find_first_not_of('\r', end);
        const bool is_lf = behind != std::string_view::npos && m_rest[behind] == '\n';
        m_rest.remove_prefix(std::min(is_lf ? behind + 1 : end + 1, m_rest.size()));
        return true;
    }

private:
    std::string_view m_rest;
};

// Takes the first word off `line`; empty at its end.
std::string_view takeWord(std::string_view& line)
{
    const size_t end = std::min(line.find_first_of(kBlank), line.size());
    const std::string_view word = line.substr(0, end);
    line = trimmed(line.substr(end));
    return word;
}

bool isNumber(std::string_view word, double& value)
{
    const char* const first = word.data() + (word.starts_with('+') ? 1 : 0);
    const auto [end, fault] = std::from_chars(first, word.data() + word.size(), value);
    return !word.empty() && fault == std::errc() && end == word.data() + word.size();
}

bool isWhole(std::string_view word, int64_t& value)
{
    const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
    return !word.empty() && fault == std::errc() && end == word.data() + word.size();
}

std::string start(std::string_view line)
{
    return "\"" + std::string(line.substr(0, 40)) + "\"";
}

// N of "# Number of images: N, ...".
std::optional<uint64_t> statedCount(std::string_view comment, std::string_view of)
{
    const std::string label = "Number of " + std::string(of) + ":";
    size_t at = comment.find(label);
    if (at == std::string_view::npos)
        return std::nullopt;
    comment = trimmed(comment.substr(at + label.size()));
    uint64_t count = 0;
    if (std::from_chars(comment.data(), comment.data() + comment.size(), count).ec != std::errc())
        return std::nullopt;
    return count;
}

void parseLens(std::string_view line, ColmapModel& model)
{
    const std::string_view whole = line;
    int64_t id = 0;
    ColmapLens lens;
    const bool numbered = isWhole(takeWord(line), id);
    const std::string_view name = takeWord(line);
    const auto known = std::ranges::find_if(lensModels(), [&](const LensModel& m) { return name == m.name; });
    const std::string_view width = takeWord(line), height = takeWord(line);
    if (!numbered || !isNumber(width, lens.width) || !isNumber(height, lens.height))
        model.fail("a camera that starts with " + start(whole), "its number, model, width and height");
    if (known == lensModels().end()) {
        model.addUnknown(id, std::string(name.substr(0, 40)));
        return;
    }
    lens.model = &*known;
    size_t values = 0;
    for (double value = 0; !line.empty(); ++values) {
        if (!isNumber(takeWord(line), value))
            model.fail("a value that is no number in the camera " + start(whole), "numbers");
        if (values < lens.values.size())
            lens.values[values] = value;
    }
    if (values != known->values)
        model.fail(formatString("%zu values in the camera ", values) + start(whole),
                   formatString("%zu for %s", known->values, known->name));
    model.addLens(id, lens);
}

// A line of points: x, y and the whole number of the point in space, -1 for none, as often as there are points.
bool isPoints(std::string_view line)
{
    size_t words = 0;
    double value = 0;
    for (; !line.empty() && words < kSurelyPoints; ++words)
        if (!isNumber(takeWord(line), value) || (words % 3 == 2 && (value < -1 || value != std::floor(value))))
            return false;
    return words % 3 == 0;
}

// Whether `line` may be an image's, even one without a name: a unit quaternion and a camera that is there stand where an
// image has them.
bool mayBeImage(std::string_view line, const ColmapModel& model)
{
    int64_t number = 0;
    double value = 0, squares = 0;
    bool good = isWhole(takeWord(line), number);
    for (size_t i = 0; i < 7 && good; ++i) {
        good = isNumber(takeWord(line), value);
        squares += i < 4 ? value * value : 0;
    }
    return good && isWhole(takeWord(line), number) && model.hasLens(number) && std::abs(squares - 1) < kSquareError;
}

void parseImage(std::string_view line, ColmapModel& model)
{
    const std::string_view whole = line;
    ColmapPose pose{};
    bool good = isWhole(takeWord(line), pose.image);
    for (double& q : pose.rotation)
        good = isNumber(takeWord(line), q) && good;
    for (double& t : pose.translation)
        good = isNumber(takeWord(line), t) && good;
    good = isWhole(takeWord(line), pose.camera) && good;
    if (!good || line.empty())
        model.fail("an image that starts with " + start(whole), "its number, quaternion, translation, camera and name");
    pose.name = line;
    model.addPose(pose);
}

// note: COLMAP takes every second line for points whatever it holds; others leave these lines out, of all images or of some.
void parseImages(std::string_view text, ColmapModel& model)
{
    TextLines lines(text);
    std::optional<uint64_t> stated;
    size_t images = 0, without = 0, points = 0;
    bool after_image = false;
    std::string first;
    for (std::string_view line; lines.next(line);) {
        if (line.starts_with('#')) {
            stated = stated ? stated : statedCount(line, "images");
            continue;
        }
        const bool is_points = after_image && !line.empty() && isPoints(line);
        if (is_points && mayBeImage(line, model))
            model.fail("a line that may be points or an image without a name, or called by numbers: " + start(line),
                       "a name with a letter in it, and a line of points, if only an empty one, behind each image");
        if (line.empty() || is_points) {
            points += after_image;
            after_image = false;
            continue;
        }
        if (after_image && without++ == 0)
            first = start(line);
        parseImage(line, model);
        after_image = true;
        ++images;
    }
    if (without > 0 && points > 0)
        model.how().warn(
            formatString("%s: images.txt has %zu images and no line of points, not even an empty one, behind "
                         "%zu of them (the line behind the first starts with %s); each is taken as an image",
                         model.name().c_str(), images, without, first.c_str()));
    if (stated)
        model.checkCount("images.txt", *stated, true);
}

} // namespace

void parseColmapText(std::string_view cameras, std::string_view images, ColmapModel& model)
{
    TextLines lines(cameras);
    std::optional<uint64_t> stated;
    for (std::string_view line; lines.next(line);) {
        if (line.starts_with('#'))
            stated = stated ? stated : statedCount(line, "cameras");
        else if (!line.empty())
            parseLens(line, model);
    }
    if (stated)
        model.checkCount("cameras.txt", *stated, false);
    parseImages(images, model);
}

} // namespace gsc
