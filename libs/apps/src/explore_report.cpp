// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/explore_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "riftmap/core/file.h"

namespace riftmap {

namespace {

const char* const kStyle = R"(body{font:15px/1.5 sans-serif;max-width:1080px;margin:2em auto;
padding:0 1em;color:#222}h1{font-size:1.5em}table{border-collapse:collapse;margin:1em 0}
td{padding:.15em 1em .15em 0;border-bottom:1px solid #ddd}td+td{font-variant-numeric:tabular-nums}
svg{margin:.5em 1em .5em 0}img{max-width:100%;margin:.5em 0}canvas{width:100%;height:620px;
background:#14171c;cursor:grab;display:block}figcaption{color:#666}svg text{font:12px sans-serif})";

// Drag turns, shift-drag shifts, the wheel moves nearer.
const char* const kViewer = R"JS(
const raw=s=>Uint8Array.from(atob(s),c=>c.charCodeAt(0)).buffer;
const cv=document.getElementById('map'),gl=cv.getContext('webgl');
const sh=(t,s)=>{const o=gl.createShader(t);gl.shaderSource(o,s);gl.compileShader(o);return o};
const pr=gl.createProgram();
gl.attachShader(pr,sh(gl.VERTEX_SHADER,`attribute vec3 p;attribute vec3 c;uniform mat4 m;
uniform float s;uniform float h;varying vec3 k;void main(){gl_Position=m*vec4(p,1.);
gl_PointSize=clamp(s*h/gl_Position.w,1.,14.);k=c;}`));
gl.attachShader(pr,sh(gl.FRAGMENT_SHADER,`precision mediump float;varying vec3 k;
void main(){gl_FragColor=vec4(k,1.);}`));
gl.linkProgram(pr);gl.useProgram(pr);
const buf=(a,t)=>{const b=gl.createBuffer();gl.bindBuffer(gl.ARRAY_BUFFER,b);
gl.bufferData(gl.ARRAY_BUFFER,a,gl.STATIC_DRAW);return b};
const one=(n,r,g,b)=>{const a=new Uint8Array(3*n);for(let i=0;i<n;i++){a[3*i]=r;a[3*i+1]=g;
a[3*i+2]=b}return a};
const set=(p,c,mode,size)=>({p:buf(p),c:buf(c),n:p.length/3,mode,size});
const P=new Float32Array(raw(D.points)),W=new Float32Array(raw(D.path)),
R=new Float32Array(raw(D.rifts));
const sets=[set(P,new Uint8Array(raw(D.colours)),gl.POINTS,D.dot)];
if(W.length)sets.push(set(W,one(W.length/3,255,190,40),gl.LINE_STRIP,1),
set(W,one(W.length/3,255,230,120),gl.POINTS,2.5*D.dot));
if(R.length)sets.push(set(R,one(R.length/3,255,60,60),gl.POINTS,2*D.dot));
let yaw=-.9,pitch=.75,dist=1.7*D.size,cx=D.centre[0],cy=D.centre[1],cz=D.centre[2];
function draw(){cv.width=cv.clientWidth*devicePixelRatio;cv.height=cv.clientHeight*devicePixelRatio;
gl.viewport(0,0,cv.width,cv.height);gl.enable(gl.DEPTH_TEST);gl.clearColor(.08,.09,.11,1);
gl.clear(gl.COLOR_BUFFER_BIT|gl.DEPTH_BUFFER_BIT);
const ca=Math.cos(yaw),sa=Math.sin(yaw),cb=Math.cos(pitch),sb=Math.sin(pitch);
const r=[-sa,ca,0],u=[-ca*sb,-sa*sb,cb],f=[-ca*cb,-sa*cb,-sb];
const e=[cx-f[0]*dist,cy-f[1]*dist,cz-f[2]*dist],dot=(a,b)=>a[0]*b[0]+a[1]*b[1]+a[2]*b[2];
const k=2.0,as=cv.width/cv.height,n=.01*D.size,fr=20*D.size,A=(fr+n)/(fr-n),B=-2*fr*n/(fr-n);
const kx=k/as,t=[-dot(r,e),-dot(u,e),-dot(f,e)];
gl.uniformMatrix4fv(gl.getUniformLocation(pr,'m'),false,[kx*r[0],k*u[0],A*f[0],f[0],
kx*r[1],k*u[1],A*f[1],f[1],kx*r[2],k*u[2],A*f[2],f[2],kx*t[0],k*t[1],A*t[2]+B,t[2]]);
gl.uniform1f(gl.getUniformLocation(pr,'h'),cv.height);
for(const s of sets){gl.uniform1f(gl.getUniformLocation(pr,'s'),s.size);
gl.bindBuffer(gl.ARRAY_BUFFER,s.p);let l=gl.getAttribLocation(pr,'p');
gl.enableVertexAttribArray(l);gl.vertexAttribPointer(l,3,gl.FLOAT,false,0,0);
gl.bindBuffer(gl.ARRAY_BUFFER,s.c);l=gl.getAttribLocation(pr,'c');gl.enableVertexAttribArray(l);
gl.vertexAttribPointer(l,3,gl.UNSIGNED_BYTE,true,0,0);gl.drawArrays(s.mode,0,s.n)}}
let last=null;cv.onpointerdown=e=>{last=[e.clientX,e.clientY];cv.setPointerCapture(e.pointerId)};
cv.onpointerup=()=>last=null;cv.onpointermove=e=>{if(!last)return;
const dx=e.clientX-last[0],dy=e.clientY-last[1];last=[e.clientX,e.clientY];
if(e.shiftKey){const s=dist/cv.clientHeight;cx+=Math.sin(yaw)*dx*s;cy-=Math.cos(yaw)*dx*s;cz+=dy*s}
else{yaw-=dx*.007;pitch=Math.max(-1.55,Math.min(1.55,pitch+dy*.007))}draw()};
cv.onwheel=e=>{e.preventDefault();dist*=Math.exp(e.deltaY*.001);draw()};onresize=draw;draw();
)JS";

std::string base64(const void* data, std::size_t size) {
    static const char* const kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto* bytes = static_cast<const unsigned char*>(data);
    std::string text;
    text.reserve((size + 2) / 3 * 4);
    for (std::size_t i = 0; i < size; i += 3) {
        const unsigned b = bytes[i] * 65536U + (i + 1 < size ? bytes[i + 1] * 256U : 0U) +
                           (i + 2 < size ? bytes[i + 2] : 0U);
        text += kDigits[b >> 18 & 63];
        text += kDigits[b >> 12 & 63];
        text += i + 1 < size ? kDigits[b >> 6 & 63] : '=';
        text += i + 2 < size ? kDigits[b & 63] : '=';
    }
    return text;
}

/// Little-endian floats, as the machines are that this runs on.
std::string base64(const std::vector<Eigen::Vector3f>& points) {
    std::vector<float> flat;
    flat.reserve(3 * points.size());
    for (const Eigen::Vector3f& p : points) {
        flat.insert(flat.end(), {p.x(), p.y(), p.z()});
    }
    return base64(flat.data(), flat.size() * sizeof(float));
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '&':
                out += "&amp;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

/// Round numbers about a fifth of the range apart.
double tickStep(double range) {
    const double raw = range / 5;
    const double base = std::pow(10.0, std::floor(std::log10(raw)));
    for (const double factor : {1.0, 2.0, 5.0}) {
        if (raw <= factor * base) {
            return factor * base;
        }
    }
    return 10 * base;
}

std::string shortNumber(double value) {
    std::ostringstream text;
    text.precision(4);
    text << value;
    return text.str();
}

std::string svg(const ReportDiagram& diagram) {
    constexpr double w = 500;
    constexpr double h = 300;
    constexpr double left = 58;
    constexpr double bottom = 44;
    constexpr double top = 30;
    constexpr double right = 12;
    const std::array<const char*, 6> colours = {"#1668b8", "#d9541e", "#2a9d4a",
                                                "#8e44ad", "#c0a000", "#555555"};
    double x1 = 1e-9;
    double y1 = 1e-9;
    for (const ReportCurve& c : diagram.curves) {
        for (std::size_t i = 0; i < c.x.size(); ++i) {
            x1 = std::max(x1, c.x[i]);
            y1 = std::isfinite(c.y[i]) ? std::max(y1, c.y[i]) : y1;
        }
    }
    const auto px = [&](double x) { return left + x / x1 * (w - left - right); };
    const auto py = [&](double y) { return h - bottom - y / y1 * (h - top - bottom); };
    std::ostringstream out;
    out << "<svg width='" << w << "' height='" << h << "'><text x='" << left
        << "' y='16' style='font-weight:bold'>" << escaped(diagram.title) << "</text>";
    for (double x = 0; x <= x1 * 1.0001; x += tickStep(x1)) {
        out << "<line x1='" << px(x) << "' x2='" << px(x) << "' y1='" << top << "' y2='"
            << h - bottom << "' stroke='#eee'/><text text-anchor='middle' x='" << px(x) << "' y='"
            << h - bottom + 16 << "'>" << shortNumber(x) << "</text>";
    }
    for (double y = 0; y <= y1 * 1.0001; y += tickStep(y1)) {
        out << "<line x1='" << left << "' x2='" << w - right << "' y1='" << py(y) << "' y2='"
            << py(y) << "' stroke='#eee'/><text text-anchor='end' x='" << left - 5 << "' y='"
            << py(y) + 4 << "'>" << shortNumber(y) << "</text>";
    }
    out << "<text text-anchor='middle' x='" << (left + w) / 2 << "' y='" << h - 8 << "'>"
        << escaped(diagram.xLabel) << "</text><text text-anchor='middle' transform='translate(13,"
        << h / 2 << ") rotate(-90)'>" << escaped(diagram.yLabel) << "</text>";
    for (std::size_t i = 0; i < diagram.curves.size(); ++i) {
        const ReportCurve& c = diagram.curves[i];
        const char* colour = colours[i % colours.size()];
        out << "<polyline fill='none' stroke-width='2' stroke='" << colour << "' points='";
        for (std::size_t k = 0; k < c.x.size(); ++k) {
            if (std::isfinite(c.y[k])) {
                out << px(c.x[k]) << ',' << py(c.y[k]) << ' ';
            }
        }
        out << "'/><text fill='" << colour << "' x='" << left + 100 + 90 * static_cast<double>(i)
            << "' y='" << h - bottom - 8 << "'>" << escaped(c.name) << "</text>";
    }
    out << "</svg>\n";
    return out.str();
}

std::string viewer(const ExploreReport& report, std::size_t maxPoints) {
    const std::size_t stride = std::max<std::size_t>(1, report.points.size() / maxPoints);
    std::vector<Eigen::Vector3f> points;
    std::vector<std::uint8_t> colours;
    Eigen::Array3f min = Eigen::Array3f::Constant(std::numeric_limits<float>::max());
    Eigen::Array3f max = -min;
    for (std::size_t i = 0; i < report.points.size(); i += stride) {
        points.push_back(report.points[i]);
        colours.insert(colours.end(), report.colours[i].begin(), report.colours[i].end());
        min = min.min(report.points[i].array());
        max = max.max(report.points[i].array());
    }
    const Eigen::Array3f middle = (min + max) / 2;
    const float size = (max - min).matrix().norm();
    std::ostringstream out;
    out << "<figure><canvas id='map'></canvas><figcaption>The map, the camera's path (yellow) and "
           "the tears that are left (red). Drag turns, shift and drag shifts, the wheel "
           "zooms.</figcaption></figure>\n<script>\nconst D={size:"
        << size << ",dot:" << 0.004F * size << ",centre:[" << middle.x() << ',' << middle.y() << ','
        << middle.z() << "],points:'" << base64(points) << "',colours:'"
        << base64(colours.data(), colours.size()) << "',path:'" << base64(report.path)
        << "',rifts:'" << base64(report.rifts) << "'};\n"
        << kViewer << "</script>\n";
    return out.str();
}

}  // namespace

void writeExploreReport(const std::filesystem::path& file, const ExploreReport& report,
                        std::size_t maxPoints) {
    if (report.points.size() != report.colours.size()) {
        throw std::invalid_argument("report: as many colours as points are needed");
    }
    std::ostringstream out;
    out << "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><title>"
        << escaped(report.title) << "</title><style>" << kStyle << "</style></head><body>\n<h1>"
        << escaped(report.title) << "</h1>\n";
    if (!report.points.empty()) {
        out << viewer(report, maxPoints);
    }
    out << "<table>\n";
    for (const auto& [name, value] : report.facts) {
        out << "<tr><td>" << escaped(name) << "</td><td>" << escaped(value) << "</td></tr>\n";
    }
    out << "</table>\n";
    for (const ReportDiagram& diagram : report.diagrams) {
        out << svg(diagram);
    }
    for (const auto& picture : report.pictures) {
        const std::string png = readFile(picture);
        out << "<figure><img alt='' src='data:image/png;base64," << base64(png.data(), png.size())
            << "'><figcaption>" << escaped(picture.stem().string()) << "</figcaption></figure>\n";
    }
    out << "</body></html>\n";
    writeAtomically(file, [&](std::ostream& stream) { stream << out.str(); });
}

}  // namespace riftmap
