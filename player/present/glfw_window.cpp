// SPDX-License-Identifier: Apache-2.0
#include "player/present/glfw_window.h"

#include <gsc/error.h>
#include "player/present/keys.h"
#include "player/present/vulkan_device.h"

#include <imgui.h>

#include <algorithm>
#include <utility>

#include <X11/Xlib.h>
#include <dlfcn.h>

namespace gsc {

namespace {

static_assert(kKeySpace == GLFW_KEY_SPACE && kKeyComma == GLFW_KEY_COMMA && kKeyMinus == GLFW_KEY_MINUS &&
              kKeyPeriod == GLFW_KEY_PERIOD && kKeyEqual == GLFW_KEY_EQUAL && 'A' == GLFW_KEY_A && '1' == GLFW_KEY_1);
static_assert(kKeyLeftBracket == GLFW_KEY_LEFT_BRACKET && kKeyRightBracket == GLFW_KEY_RIGHT_BRACKET &&
              kKeyEscape == GLFW_KEY_ESCAPE && kKeyTab == GLFW_KEY_TAB && kKeyRight == GLFW_KEY_RIGHT &&
              kKeyLeft == GLFW_KEY_LEFT && kKeyDown == GLFW_KEY_DOWN && kKeyUp == GLFW_KEY_UP);
static_assert(kKeyPageUp == GLFW_KEY_PAGE_UP && kKeyPageDown == GLFW_KEY_PAGE_DOWN && kKeyHome == GLFW_KEY_HOME &&
              kKeyF1 == GLFW_KEY_F1 && kKeyF2 == GLFW_KEY_F2 && kKeyF11 == GLFW_KEY_F11 && kKeyF12 == GLFW_KEY_F12);
static_assert(kKeyLeftShift == GLFW_KEY_LEFT_SHIFT && kKeyLeftControl == GLFW_KEY_LEFT_CONTROL &&
              kKeyLeftAlt == GLFW_KEY_LEFT_ALT && kKeyRightShift == GLFW_KEY_RIGHT_SHIFT &&
              kKeyRightControl == GLFW_KEY_RIGHT_CONTROL && kKeyRightAlt == GLFW_KEY_RIGHT_ALT &&
              kModifierControl == GLFW_MOD_CONTROL);
static_assert(kMouseLeft == GLFW_MOUSE_BUTTON_LEFT && kMouseRight == GLFW_MOUSE_BUTTON_RIGHT &&
              kPadA == GLFW_GAMEPAD_BUTTON_A && kPadB == GLFW_GAMEPAD_BUTTON_B && kPadX == GLFW_GAMEPAD_BUTTON_X &&
              kPadY == GLFW_GAMEPAD_BUTTON_Y);
static_assert(kPadLeftBumper == GLFW_GAMEPAD_BUTTON_LEFT_BUMPER && kPadBack == GLFW_GAMEPAD_BUTTON_BACK &&
              kPadRightBumper == GLFW_GAMEPAD_BUTTON_RIGHT_BUMPER && kPadStart == GLFW_GAMEPAD_BUTTON_START);
static_assert(kAxisLeftX == GLFW_GAMEPAD_AXIS_LEFT_X && kAxisLeftY == GLFW_GAMEPAD_AXIS_LEFT_Y &&
              kAxisRightX == GLFW_GAMEPAD_AXIS_RIGHT_X && kAxisRightY == GLFW_GAMEPAD_AXIS_RIGHT_Y &&
              kAxisLeftTrigger == GLFW_GAMEPAD_AXIS_LEFT_TRIGGER &&
              kAxisRightTrigger == GLFW_GAMEPAD_AXIS_RIGHT_TRIGGER);

// Returns the monitor that most of the window lies on; null where there is none.
GLFWmonitor* monitorOf(const int (&place)[4])
{
    int count = 0;
    GLFWmonitor** const monitors = glfwGetMonitors(&count);
    GLFWmonitor* found = nullptr;
    int64_t most = -1;
    for (int i = 0; i < count; ++i) {
        int x = 0, y = 0;
        glfwGetMonitorPos(monitors[i], &x, &y);
        const GLFWvidmode* const mode = glfwGetVideoMode(monitors[i]);
        if (mode == nullptr)
            continue;
        const auto overlap = [](int low, int size, int other, int other_size) {
            return int64_t(std::max(0, std::min(low + size, other + other_size) - std::max(low, other)));
        };
        const int64_t area = overlap(place[0], place[2], x, mode->width) * overlap(place[1], place[3], y, mode->height);
        if (area > most) {
            most = area;
            found = monitors[i];
        }
    }
    return found;
}

// True once the X server, or the window, has gone. Xlib ends the process if its server goes away, or if a window is
// destroyed while in use. Its handler for a lost server must not return, and any later use of the connection crashes:
// so the handler throws, through GLFW, and nothing of the display is used from then on.
bool g_server_gone = false, g_window_gone = false;
Window g_window = 0;

int serverGone(Display*)
{
    g_server_gone = true;
    throw Error(ErrorCode::Device, "display", "the X server has gone", "it to stay",
                "start again when it is back, or write pictures (gsc-play FILE --out FOLDER)");
}

int requestFailed(Display*, XErrorEvent* event)
{
    g_window_gone = g_window_gone || event->resourceid == g_window;
    return 0;
}

// note: Xlib is looked up, because GLFW loads it; if it is not in the process, the window is no X window
void catchDisplayLoss(GLFWwindow* window)
{
    // declared as in GLFW/glfw3native.h, which would need headers of X extensions too
    const auto window_of = reinterpret_cast<Window (*)(GLFWwindow*)>(dlsym(RTLD_DEFAULT, "glfwGetX11Window"));
    void* const xlib = dlopen("libX11.so.6", RTLD_LAZY | RTLD_NOLOAD);
    if (xlib == nullptr || window_of == nullptr)
        return;
    g_window = window_of(window);
    using ServerHandler = int (*)(Display*);
    using RequestHandler = int (*)(Display*, XErrorEvent*);
    if (auto* const set = reinterpret_cast<ServerHandler (*)(ServerHandler)>(dlsym(xlib, "XSetIOErrorHandler")))
        set(serverGone);
    if (auto* const set = reinterpret_cast<RequestHandler (*)(RequestHandler)>(dlsym(xlib, "XSetErrorHandler")))
        set(requestFailed);
}

std::string lastGlfwError()
{
    const char* text = nullptr;
    glfwGetError(&text);
    return text != nullptr ? text : "no reason given";
}

GamepadState gamepadState()
{
    GamepadState state;
    for (int i = GLFW_JOYSTICK_1; i <= GLFW_JOYSTICK_LAST && !state.present; ++i) {
        GLFWgamepadstate pad{};
        if (!glfwJoystickIsGamepad(i) || !glfwGetGamepadState(i, &pad))
            continue;
        state.present = true;
        std::copy_n(pad.axes, state.axes.size(), state.axes.begin());
        for (uint32_t b = 0; b <= GLFW_GAMEPAD_BUTTON_LAST; ++b)
            state.buttons |= uint32_t(pad.buttons[b] == GLFW_PRESS) << b;
    }
    return state;
}

} // namespace

GlfwWindow::GlfwWindow(const std::string& title, uint32_t width, uint32_t height)
{
    if (!glfwInit())
        throw Error(ErrorCode::Unsupported, "display", "none is there (" + lastGlfwError() + ")",
                    "X11's DISPLAY to name one",
                    "start it from a desktop, or write pictures (gsc-play FILE --out FOLDER)");
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    m_window = glfwCreateWindow(int(width), int(height), title.c_str(), nullptr, nullptr);
    if (m_window == nullptr) {
        const std::string why = lastGlfwError();
        glfwTerminate();
        throw Error(ErrorCode::Unsupported, "display", "opens no window (" + why + ")", "one", "play without one");
    }
    catchDisplayLoss(m_window);
    glfwSetWindowUserPointer(m_window, this);
    glfwSetWindowRefreshCallback(m_window, [](GLFWwindow* w) { of(w).m_exposed = true; });
    glfwSetKeyCallback(m_window, [](GLFWwindow* w, int key, int, int action, int modifiers) {
        if (action == GLFW_REPEAT)
            return;
        InputEvent event;
        event.code = key;
        event.down = action == GLFW_PRESS;
        event.modifiers = modifiers;
        event.overlay = event.down && ImGui::GetIO().WantCaptureKeyboard;
        of(w).add(event);
    });
    glfwSetMouseButtonCallback(m_window, [](GLFWwindow* w, int button, int action, int modifiers) {
        InputEvent event{InputEvent::Kind::Button, button, action == GLFW_PRESS, modifiers};
        event.overlay = event.down && ImGui::GetIO().WantCaptureMouse;
        of(w).add(event);
    });
    glfwSetCursorPosCallback(m_window, [](GLFWwindow* w, double x, double y) {
        // GLFW states the cursor in units of the screen, not in pixels
        int wide = 0, high = 0, pixels_wide = 0, pixels_high = 0;
        glfwGetWindowSize(w, &wide, &high);
        glfwGetFramebufferSize(w, &pixels_wide, &pixels_high);
        InputEvent event;
        event.kind = InputEvent::Kind::Move;
        event.x = wide > 0 ? x * pixels_wide / wide : x;
        event.y = high > 0 ? y * pixels_high / high : y;
        event.overlay = ImGui::GetIO().WantCaptureMouse;
        of(w).add(event);
    });
    glfwSetDropCallback(m_window, [](GLFWwindow* w, int count, const char** paths) {
        of(w).m_dropped.insert(of(w).m_dropped.end(), paths, paths + count);
    });
    glfwSetScrollCallback(m_window, [](GLFWwindow* w, double x, double y) {
        InputEvent event;
        event.kind = InputEvent::Kind::Scroll;
        event.x = x;
        event.y = y;
        event.overlay = ImGui::GetIO().WantCaptureMouse;
        of(w).add(event);
    });
}

void GlfwWindow::toggleFullScreen()
{
    if (glfwGetWindowMonitor(m_window) != nullptr) {
        glfwSetWindowMonitor(m_window, nullptr, m_place[0], m_place[1], m_place[2], m_place[3], GLFW_DONT_CARE);
        return;
    }
    glfwGetWindowPos(m_window, &m_place[0], &m_place[1]);
    glfwGetWindowSize(m_window, &m_place[2], &m_place[3]);
    if (GLFWmonitor* const monitor = monitorOf(m_place)) {
        const GLFWvidmode* const mode = glfwGetVideoMode(monitor);
        glfwSetWindowMonitor(m_window, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
    }
}

GlfwWindow::~GlfwWindow()
{
    GlfwWindow::unlessGone([this] {
        glfwDestroyWindow(m_window);
        glfwTerminate();
    });
}

void GlfwWindow::unlessGone(const std::function<void()>& end)
{
    try {
        if (!g_server_gone)
            end();
    } catch (const Error&) { // the display has just gone, which the next poll() reports
    }
}

WindowInput GlfwWindow::poll(double seconds)
{
    if (seconds > 0)
        glfwWaitEventsTimeout(seconds);
    else
        glfwPollEvents();
    if (g_window_gone)
        throw Error(ErrorCode::Device, "display", "another program destroyed the window", "that it asks to close it",
                    "start again");
    WindowInput input;
    input.events = std::exchange(m_events, {});
    input.dropped = std::exchange(m_dropped, {});
    input.gamepad = gamepadState();
    int width = 0, height = 0;
    glfwGetFramebufferSize(m_window, &width, &height);
    const bool shown = glfwGetWindowAttrib(m_window, GLFW_ICONIFIED) == GLFW_FALSE &&
                       glfwGetWindowAttrib(m_window, GLFW_VISIBLE) == GLFW_TRUE;
    input.width = shown ? uint32_t(std::max(width, 0)) : 0;
    input.height = shown ? uint32_t(std::max(height, 0)) : 0;
    input.exposed = std::exchange(m_exposed, false) && shown;
    input.scale = scale();
    input.closed = glfwWindowShouldClose(m_window) == GLFW_TRUE;
    return input;
}

VkSurfaceKHR GlfwWindow::makeSurface(VkInstance instance)
{
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    checkVulkan(glfwCreateWindowSurface(instance, m_window, nullptr, &surface), "glfwCreateWindowSurface");
    return surface;
}

float GlfwWindow::scale() const
{
    float x = 1, y = 1;
    glfwGetWindowContentScale(m_window, &x, &y);
    return std::max(x, y);
}

std::vector<const char*> surfaceExtensions()
{
    uint32_t count = 0;
    const char** const names = glfwGetRequiredInstanceExtensions(&count);
    if (names == nullptr)
        throw Error(ErrorCode::Unsupported, "display", "its Vulkan driver shows no windows", "one that does",
                    "install one, such as mesa-vulkan-drivers, or write pictures (gsc-play FILE --out FOLDER)");
    return {names, names + count};
}

} // namespace gsc
