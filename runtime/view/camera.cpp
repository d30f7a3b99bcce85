// SPDX-License-Identifier: Apache-2.0
#include <gsc/camera.h>

#include <gsc/error.h>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gsc {

namespace {

// near and far plane of the trainers; they change no pixel, only the third row of `full`
constexpr double kNear = 0.01, kFar = 100;

double multiplyAdd(double a, double b, double c)
{
    return a * b + c;
}
float multiplyAdd(float a, float b, float c)
{
    return std::fma(a, b, c);
}

// Inverts a row-major 4 x 4 matrix by LU decomposition with partial pivoting. note: the float version fuses each
// multiply-add and multiplies by the pivot's reciprocal, as the trainers' library does on their GPU: the camera's
// centre is equal bit for bit for every camera of the golden data
template <typename T>
void invert4(const T in[16], T out[16])
{
    T a[4][4], x[4][4];
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            a[i][j] = in[4 * i + j];
            x[i][j] = T(i == j);
        }
    for (int k = 0; k < 4; ++k) {
        int pivot = k;
        for (int i = k + 1; i < 4; ++i)
            if (std::abs(a[i][k]) > std::abs(a[pivot][k]))
                pivot = i;
        if (pivot != k) {
            std::swap(a[pivot], a[k]);
            std::swap(x[pivot], x[k]);
        }
        const T reciprocal = T(1) / a[k][k];
        for (int i = k + 1; i < 4; ++i) {
            a[i][k] *= reciprocal;
            for (int j = k + 1; j < 4; ++j)
                a[i][j] = multiplyAdd(-a[i][k], a[k][j], a[i][j]);
        }
    }
    for (int c = 0; c < 4; ++c) {
        for (int i = 1; i < 4; ++i)
            for (int k = 0; k < i; ++k)
                x[i][c] = multiplyAdd(-a[i][k], x[k][c], x[i][c]);
        for (int i = 3; i >= 0; --i) {
            for (int k = 3; k > i; --k)
                x[i][c] = multiplyAdd(-a[i][k], x[k][c], x[i][c]);
            x[i][c] /= a[i][i];
        }
    }
    for (int i = 0; i < 16; ++i)
        out[i] = x[i / 4][i % 4];
}

// Computes the row-major 4 x 4 matrix [R^T | t + R^T origin].
void worldToView(const Camera& camera, const double origin[3], double out[16])
{
    for (int r = 0; r < 3; ++r) {
        out[4 * r + 3] = camera.translation[r];
        for (int c = 0; c < 3; ++c) {
            out[4 * r + c] = camera.rotation[3 * c + r];
            if (origin[c] != 0) // adding 0 would turn a -0 into +0, unlike in the trainers' matrix
                out[4 * r + 3] += out[4 * r + c] * origin[c];
        }
        out[12 + r] = 0;
    }
    out[15] = 1;
}

// Computes the entries of the projection that are neither 0 nor 1: P00, P11, P22, P23, P02, P12.
void projectionEntries(const Camera& camera, double out[6])
{
    // in the trainers' order of operations, through half the extents of the near plane
    const double right = std::tan(camera.fov_x / 2) * kNear;
    const double top = std::tan(camera.fov_y / 2) * kNear;
    out[0] = 2 * kNear / (right + right);
    out[1] = 2 * kNear / (top + top);
    out[2] = kFar / (kFar - kNear);
    out[3] = -(kFar * kNear) / (kFar - kNear);
    out[4] = -out[0] * camera.tan_mid_x;
    out[5] = -out[1] * camera.tan_mid_y;
}

template <typename T>
void fullProjection(const double projection[6], const T world_to_view[12], T out[16])
{
    for (int c = 0; c < 4; ++c) {
        out[c] = T(projection[0]) * world_to_view[c];
        out[4 + c] = T(projection[1]) * world_to_view[4 + c];
        // note: adding a product of zero would lose the trainers' signed zeros
        if (projection[4] != 0)
            out[c] += T(projection[4]) * world_to_view[8 + c];
        if (projection[5] != 0)
            out[4 + c] += T(projection[5]) * world_to_view[8 + c];
        out[8 + c] = T(projection[2]) * world_to_view[8 + c];
        out[12 + c] = world_to_view[8 + c];
    }
    out[11] += T(projection[3]);
}

// Sets the fields of `eye` that depend on the lens and on eye.world_to_view. T is the type of their numbers.
template <typename T, typename Eye>
void setLens(const Camera& camera, Eye& eye)
{
    double projection[6];
    projectionEntries(camera, projection);
    fullProjection(projection, eye.world_to_view, eye.full_projection);
    eye.tan_fov_x = T(std::tan(camera.fov_x * 0.5));
    eye.tan_fov_y = T(std::tan(camera.fov_y * 0.5));
    eye.tan_mid_x = T(camera.tan_mid_x);
    eye.tan_mid_y = T(camera.tan_mid_y);
    eye.focal_x = T(camera.width) / (T(2) * eye.tan_fov_x);
    eye.focal_y = T(camera.height) / (T(2) * eye.tan_fov_y);
    eye.width = camera.width;
    eye.height = camera.height;
}

} // namespace

SourceCamera sourceCamera(const CameraRecord& record, std::string_view names)
{
    SourceCamera camera;
    camera.name = names.substr(record.name_offset, record.name_bytes);
    camera.id = record.id;
    camera.width = record.width;
    camera.height = record.height;
    std::copy_n(record.position, 3, camera.position);
    std::copy_n(record.rotation, 9, camera.rotation);
    camera.fx = record.fx;
    camera.fy = record.fy;
    camera.appearance = record.appearance;
    camera.is_test = record.is_test != 0;
    return camera;
}

void finishCamera(Camera& camera, uint32_t width, uint32_t height, double fov_x)
{
    // a focal length in pixels belongs to the size of the photograph or, if that is unknown, to the size asked for
    const uint32_t base_width = camera.width > 0 ? camera.width : width;
    const uint32_t base_height = camera.height > 0 ? camera.height : height;
    if (base_width == 0 || base_height == 0)
        throw Error(ErrorCode::Usage, "camera " + camera.name, "its file states no image size", "one", "state one")
            .with({Setting::ImageSize});
    if (camera.focal_x > 0 && camera.focal_y > 0) {
        camera.fov_x = 2 * std::atan(base_width / (2 * camera.focal_x));
        camera.fov_y = 2 * std::atan(base_height / (2 * camera.focal_y));
        camera.focal_x = camera.focal_y = 0;
    }
    const bool square_pixels = fov_x > 0 || !(camera.fov_y > 0);
    const bool zooms_off_axis = fov_x > 0 && (camera.tan_mid_x != 0 || camera.tan_mid_y != 0);
    if (zooms_off_axis) { // kept as a share of half the image's size, which a new angle does not change
        camera.tan_mid_x /= std::tan(camera.fov_x / 2);
        camera.tan_mid_y /= std::tan(camera.fov_y / 2);
    }
    if (fov_x > 0)
        camera.fov_x = fov_x;
    if (!(camera.fov_x > 0)) {
        if (!(camera.fov_y > 0))
            throw Error(ErrorCode::Usage, "camera " + camera.name, "its file states no field of view", "one",
                        "state one")
                .with({Setting::FieldOfView});
        camera.fov_x = 2 * std::atan(std::tan(camera.fov_y / 2) * base_width / base_height);
    }
    const double focal_x = base_width / (2 * std::tan(camera.fov_x / 2));
    if (square_pixels)
        camera.fov_y = 2 * std::atan(base_height / (2 * focal_x));
    if (zooms_off_axis) {
        camera.tan_mid_x *= std::tan(camera.fov_x / 2);
        camera.tan_mid_y *= std::tan(camera.fov_y / 2);
    }
    const auto scaled = [](uint32_t side, uint32_t to, uint32_t from) {
        return uint32_t(std::max(1.0, std::round(double(side) * to / from)));
    };
    const uint32_t new_width = width > 0 ? width : height > 0 ? scaled(base_width, height, base_height) : base_width;
    const uint32_t new_height = height > 0 ? height : width > 0 ? scaled(base_height, width, base_width) : base_height;
    if (width > 0 && height > 0 && uint64_t(new_width) * base_height != uint64_t(new_height) * base_width) {
        // pixels keep their shape, and the whole of the camera's picture is inside: one axis shows more
        const double taller = (double(new_height) / new_width) / (double(base_height) / base_width);
        if (taller > 1 || fov_x > 0)
            camera.fov_y = 2 * std::atan(std::tan(camera.fov_y / 2) * taller);
        else
            camera.fov_x = 2 * std::atan(std::tan(camera.fov_x / 2) / taller);
    }
    camera.width = new_width;
    camera.height = new_height;
}

EyeParams eyeParams(const Camera& camera, const double (&origin)[3])
{
    EyeParams eye{};
    double rigid[16], camera_to_world[16], again[16];
    worldToView(camera, origin, rigid);
    invert4(rigid, camera_to_world);
    invert4(camera_to_world, again);
    for (int i = 0; i < 12; ++i)
        eye.world_to_view[i] = float(again[i]);

    setLens<float>(camera, eye);

    // the trainers invert the transposed (row-vector) matrix; the pivots, and so the last bits, depend on that
    float transposed[16] = {}, inverse[16];
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c)
            transposed[4 * c + r] = eye.world_to_view[4 * r + c];
    transposed[15] = 1;
    invert4(transposed, inverse);
    std::copy_n(inverse + 12, 3, eye.center);
    return eye;
}

EyeParams64 eyeParams64(const Camera& camera, const double (&origin)[3])
{
    EyeParams64 eye{};
    double rigid[16], camera_to_world[16];
    worldToView(camera, origin, rigid);
    invert4(rigid, camera_to_world);
    std::copy_n(rigid, 12, eye.world_to_view);
    setLens<double>(camera, eye);
    for (int i = 0; i < 3; ++i)
        eye.center[i] = camera_to_world[4 * i + 3];
    return eye;
}

void stereoPair(const Camera& camera, double ipd, Camera& left, Camera& right)
{
    left = camera;
    right = camera;
    // R^T times the unit right axis: (1, 0, 0), or a longer vector if a transforms file scales the world
    const glm::dmat3 to_view = glm::make_mat3(camera.rotation);
    const glm::dvec3 axis = transpose(to_view)[0], shift = to_view * axis / length(axis) * ipd / 2.0;
    for (int i = 0; i < 3; ++i) {
        left.translation[i] += shift[i];
        right.translation[i] -= shift[i];
    }
}

Camera eyeOfHead(const Camera& head, const EyeView& view)
{
    Camera eye = head;
    // row-major matrices read as column-major are the transposes, so the order of the product is reversed, too
    const glm::dmat3 inner = glm::make_mat3(view.rotation), turned = inner * glm::make_mat3(head.rotation);
    std::copy_n(glm::value_ptr(turned), 9, eye.rotation);
    // place of the world's origin relative to the eye, in the head's axes
    const glm::dvec3 from_eye = glm::make_vec3(head.translation) - glm::make_vec3(view.position);
    const glm::dvec3 translation = inner * from_eye;
    std::copy_n(glm::value_ptr(translation), 3, eye.translation);
    const double left = std::tan(view.left), right = std::tan(view.right);
    const double top = -std::tan(view.up), bottom = -std::tan(view.down); // in a camera's axes y points down
    eye.fov_x = 2 * std::atan((right - left) / 2);
    eye.fov_y = 2 * std::atan((bottom - top) / 2);
    eye.tan_mid_x = (left + right) / 2;
    eye.tan_mid_y = (top + bottom) / 2;
    eye.focal_x = eye.focal_y = 0;
    return eye;
}

} // namespace gsc
