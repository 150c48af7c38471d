(function(){"use strict";const J=`
#define ROW 44
#define EDGE 1e-6
layout(std140) uniform Edits { vec4 rows[1024]; };
uniform sampler2D lattice;
uniform int editCount;
uniform int boxCount;
uniform bool preserveOpacity;

float largest(vec3 v) { return max(max(v.x, v.y), v.z); }

bool inBox(vec3 p, vec3 low, vec3 high) { return all(greaterThanEqual(p, low)) && all(lessThanEqual(p, high)); }

vec3 times(int at, vec3 v) { return vec3(dot(rows[at].xyz, v), dot(rows[at + 1].xyz, v), dot(rows[at + 2].xyz, v)); }

vec3 solveColumns(vec3 u, vec3 v, vec3 w, vec3 r) {
  vec3 vw = cross(v, w);
  float det = dot(u, vw);
  if (abs(det) < 1e-6) det = det >= 0.0 ? 1e-6 : -1e-6;
  return vec3(dot(r, vw), dot(u, cross(r, w)), dot(u, cross(v, r))) / det;
}

vec3 bendSolve(int at, vec3 xi, vec3 r) {
  vec3 a = rows[at].xyz;
  vec3 b = rows[at + 1].xyz;
  vec3 c = rows[at + 2].xyz;
  vec3 g = rows[at + 3].xyz;
  return solveColumns(
    vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g,
    vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g,
    vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g,
    r
  );
}

vec3 bent(int at, vec3 xi) {
  return xi + xi.x * xi.y * rows[at].xyz + xi.x * xi.z * rows[at + 1].xyz + xi.y * xi.z * rows[at + 2].xyz
    + xi.x * xi.y * xi.z * rows[at + 3].xyz;
}

// Coordinates in the hexahedron at a row, clamped to [-1,1]^3, and how far off that is.
vec3 hexahedron(vec3 p, int at, out float error) {
  vec3 y = times(at, p - rows[at + 3].xyz);
  vec3 xi = y;
  error = 0.0;
  if (rows[at].w < 0.5) {
    if (inBox(y, rows[at + 4].xyz, rows[at + 5].xyz)) {
      xi = clamp(y, -1.0, 1.0);
      for (int n = 0; n < 16; n++) {
        vec3 next = clamp(xi - bendSolve(at + 6, xi, bent(at + 6, xi) - y), -1.4, 1.4);
        float by = largest(abs(next - xi));
        xi = next;
        if (by < 1e-4) break;
      }
      error = largest(abs(bent(at + 6, xi) - y));
      if (error < 2e-6) error = 0.0;
    } else {
      error = 10.0;
    }
  }
  error += max(largest(abs(xi)) - 1.0, 0.0);
  return clamp(xi, -1.0, 1.0);
}

// Takes p and the direction v to canonical space by the coordinates xi in the hexahedron at a row.
void image(vec3 xi, int at, inout vec3 p, inout vec3 v) {
  vec3 along = times(at, v);
  int c = at + 10;
  vec3 c1 = rows[c + 1].xyz;
  vec3 c2 = rows[c + 2].xyz;
  vec3 c4 = rows[c + 4].xyz;
  p = rows[c].xyz + xi.x * c1 + xi.y * c2 + xi.z * c4;
  if (rows[at].w < 0.5) {
    along = bendSolve(at + 6, xi, along);
    vec3 c3 = rows[c + 3].xyz;
    vec3 c5 = rows[c + 5].xyz;
    vec3 c6 = rows[c + 6].xyz;
    vec3 c7 = rows[c + 7].xyz;
    p += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7;
    c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7;
    c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7;
    c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7;
  }
  v = along.x * c1 + along.y * c2 + along.z * c4;
}

vec3 node(int n) { return texelFetch(lattice, ivec2(n & 2047, n >> ${Math.log2(2048)}), 0).xyz; }

void interpolate(int e, int resolution_, vec3 at, inout vec3 p, inout vec3 v) {
  vec3 s = times(e + 3, v);
  vec3 g = clamp(at, 0.0, float(resolution_ - 1));
  ivec3 cell = min(ivec3(g), resolution_ - 2);
  vec3 f = g - vec3(cell);
  int plane = resolution_ * resolution_;
  int n = int(rows[e + 6].w) + (cell.z * resolution_ + cell.y) * resolution_ + cell.x;
  vec3 v000 = node(n);
  vec3 v010 = node(n + resolution_);
  vec3 v001 = node(n + plane);
  vec3 v011 = node(n + plane + resolution_);
  vec3 x00 = node(n + 1) - v000;
  vec3 x10 = node(n + resolution_ + 1) - v010;
  vec3 x01 = node(n + plane + 1) - v001;
  vec3 x11 = node(n + plane + resolution_ + 1) - v011;
  vec3 w00 = v000 + f.x * x00;
  vec3 w10 = v010 + f.x * x10;
  vec3 w01 = v001 + f.x * x01;
  vec3 w11 = v011 + f.x * x11;
  vec3 y0 = w10 - w00;
  vec3 y1 = w11 - w01;
  vec3 z0 = w00 + f.y * y0;
  vec3 z1 = w01 + f.y * y1;
  vec3 x0 = x00 + f.y * (x10 - x00);
  vec3 x1 = x01 + f.y * (x11 - x01);
  p += z0 + f.z * (z1 - z0);
  v += s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0);
}

// Takes a sample through the edit whose numbers begin at a row; true where it was emptied.
bool mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + 3].w > 0.5;
  int resolution_ = int(rows[e + 2].w);
  int first = e + 8;
  if (rows[e + 4].w > 0.5) {
    vec3 y = times(first, p - rows[first + 3].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return false;
    }
    vec3 at = times(e + 3, p - rows[e + 2].xyz);
    if (inBox(at, rows[e + 6].xyz, rows[e + 7].xyz)) interpolate(e, resolution_, at, p, v);
    return false;
  }
  float error;
  if (rows[e].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return false;
    }
  }
  if (rows[e + 1].w < 1.5) return false;
  hexahedron(p, first + 18, error);
  if (!continuous) return error <= EDGE;
  if (error <= EDGE) interpolate(e, resolution_, times(e + 3, p - rows[e + 2].xyz), p, v);
  return false;
}

MAP_SAMPLE
// The part of a ray outside which no edit changes anything.
vec2 editedPart(vec3 origin, vec3 d) {
  vec2 part = vec2(1e30, -1e30);
  vec3 inverse_ = safeInverse(d);
  for (int k = 0; k < boxCount; k++) {
    int at = editCount * ROW + 2 * k;
    vec2 through = slab(origin, inverse_, rows[at].xyz, rows[at + 1].xyz);
    if (through.x <= through.y) part = vec2(min(part.x, through.x), max(part.y, through.y));
  }
  return part;
}

vec3 throughEdits(vec3 slope, vec3 p) {
  vec3 result;
  for (int a = 0; a < 3; a++) {
    vec3 q = p;
    vec3 v = vec3(a == 0, a == 1, a == 2);
    mapSample(q, v);
    result[a] = dot(slope, v);
  }
  return result;
}
`,Z=2;function Q(i){return i<=Z?i:null}function ee(i){const e=n=>`if (inBox(p, rows[${n}].xyz, rows[${n} + 1].xyz) && mapEdit(${n}, p, v)) return true;`,r=["bool mapSample(inout vec3 p, inout vec3 v) {",...(i===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * ROW")} }`]:Array.from({length:i},(n,o)=>e(`${i-1-o} * ROW`))).map(n=>`  ${n}`),"  return false;","}"];return J.replace("MAP_SAMPLE",`${r.join(`
`)}
`)}class N extends Error{}function te(i,e){const t=i.field.brick,r=t+1,n=i.header.resolution.map(f=>Math.ceil((f-1)/t)),o=ie(i,n),s=Math.min(255,Math.floor(e/r)),c=Math.min(s,Math.max(1,Math.ceil(Math.cbrt(o.length)))),a=Math.min(s,Math.max(1,Math.ceil(Math.sqrt(o.length/c)))),l=Math.max(1,Math.ceil(o.length/(c*a)));if(l>s)throw new N(`${o.length} bricks do not fit into textures of ${e} texels an edge`);const u=new Uint8Array(4*n[0]*n[1]*n[2]);for(const[f,d]of o.entries())u.set([f%c,Math.floor(f/c)%a,Math.floor(f/(c*a)),255],4*d);const h=Math.ceil(3*i.header.steps.length/4);return{brick:t,edge:r,dims:n,across:[c,a,l],count:o.length,index:u,bricks:o,colours:h}}function re({across:i,edge:e,colours:t,index:r}){return i[0]*i[1]*i[2]*e**3*(2+4*t)+r.length}function ie(i,e){const{codes:t,dims:r}=i.occupancy,n=i.field.brick/4,o=new Uint8Array(e[0]*e[1]*e[2]);let s=0;for(let c=0;c<r[0];c++)for(let a=0;a<r[1];a++)for(let l=0;l<r[2];l++,s++)t[s]<256&&(o[(Math.floor(c/n)*e[1]+Math.floor(a/n))*e[2]+Math.floor(l/n)]=1);return Int32Array.from(o.keys()).filter(c=>o[c]===1)}class ne{constructor(e,t){this.level=e,this.layout=t;const{brick:r}=t;this.wire=e.header.resolution.map(c=>Math.ceil(c/r));const n=r**3;this.numbers=new Int32Array(e.bricks.length).fill(-1),this.slots=new Int32Array(e.masks.length/(n/8)*n).fill(-1);let o=0;e.bricks.forEach((c,a)=>{c&&(this.numbers[a]=o++)});let s=0;for(let c=0;c<this.slots.length;c++)e.masks[c>>3]>>(c&7)&1&&(this.slots[c]=s++)}slots;numbers;wire;layer(e){const{across:t,edge:r,count:n,colours:o,bricks:s}=this.layout,c=t[0]*t[1]*r**3,a={density:new Uint16Array(c),colours:Array.from({length:o},()=>new Uint8Array(4*c).fill(128))},l=e*t[0]*t[1],u=new Int32Array(r**3);for(let h=l;h<Math.min(n,l+t[0]*t[1]);h++)this.vertices(s[h],u),this.put(a,h-l,u);return a}vertices(e,t){const{dims:r,brick:n,edge:o}=this.layout,s=[Math.floor(e/(r[1]*r[2])),Math.floor(e/r[2])%r[1],e%r[2]];let c=0;for(let a=0;a<o;a++)for(let l=0;l<o;l++)for(let u=0;u<o;u++,c++){const h=a<n?s[0]:s[0]+1,f=l<n?s[1]:s[1]+1,d=u<n?s[2]:s[2]+1;if(t[c]=-1,h>=this.wire[0]||f>=this.wire[1]||d>=this.wire[2])continue;const x=this.numbers[(h*this.wire[1]+f)*this.wire[2]+d];x>=0&&(t[c]=this.slots[((x*n+a%n)*n+l%n)*n+u%n])}}put(e,t,r){const{across:n,edge:o}=this.layout,{density:s,sh:c,header:a}=this.level,l=n[0]*o,u=l*n[1]*o,h=t%n[0]*o+Math.floor(t/n[0])*o*l,f=3*a.steps.length;let d=0;for(let x=0;x<o;x++)for(let m=0;m<o;m++)for(let p=0;p<o;p++,d++){const w=r[d];if(w<0)continue;const v=h+x*u+m*l+p;e.density[v]=s[w];for(let y=0;y<f;y++)e.colours[y>>2][4*v+(y&3)]=c[y*a.vertices+w]}}}function F(i,e,t){const r=performance.now(),n=i.createProgram();for(const[c,a]of[[i.VERTEX_SHADER,e],[i.FRAGMENT_SHADER,t]]){const l=i.createShader(c);if(l===null)throw new Error("the GPU's context is lost");i.shaderSource(l,a),i.compileShader(l),i.attachShader(n,l),i.deleteShader(l)}if(i.linkProgram(n),!i.getProgramParameter(n,i.LINK_STATUS)&&!i.isContextLost()){const a=(i.getAttachedShaders(n)??[]).map(l=>i.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${a.join(" ")} ${i.getProgramInfoLog(n)??""}`)}const o=new Map;return{program:n,uniform:c=>{const a=o.get(c);if(a!==void 0)return a;const l=i.getUniformLocation(n,c);return o.set(c,l),l},milliseconds:performance.now()-r}}function I(i,e,t,r){for(;i.getError()!==i.NO_ERROR;);const n=i.createTexture();if(i.bindTexture(i.TEXTURE_3D,n),i.texStorage3D(i.TEXTURE_3D,1,e,t[0],t[1],t[2]),L(i,i.TEXTURE_3D,r),i.getError()===i.OUT_OF_MEMORY)throw i.deleteTexture(n),new Error("the GPU has not enough memory for the field");return n}function L(i,e,t){i.texParameteri(e,i.TEXTURE_MIN_FILTER,t),i.texParameteri(e,i.TEXTURE_MAG_FILTER,t);for(const r of e===i.TEXTURE_3D?[i.TEXTURE_WRAP_S,i.TEXTURE_WRAP_T,i.TEXTURE_WRAP_R]:[i.TEXTURE_WRAP_S,i.TEXTURE_WRAP_T])i.texParameteri(e,r,i.CLAMP_TO_EDGE)}function D(i){i.bindBuffer(i.PIXEL_UNPACK_BUFFER,null),i.pixelStorei(i.UNPACK_ALIGNMENT,1),i.pixelStorei(i.UNPACK_FLIP_Y_WEBGL,!1),i.pixelStorei(i.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),i.pixelStorei(i.UNPACK_COLORSPACE_CONVERSION_WEBGL,i.NONE);for(const e of[i.UNPACK_ROW_LENGTH,i.UNPACK_IMAGE_HEIGHT,i.UNPACK_SKIP_PIXELS,i.UNPACK_SKIP_ROWS,i.UNPACK_SKIP_IMAGES])i.pixelStorei(e,0)}async function oe(i,e,t,r){const n=te(e,i.getParameter(i.MAX_3D_TEXTURE_SIZE)),o=re(n);if(o>t)throw new N(`the field takes ${Math.ceil(o/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);const{across:s,edge:c,dims:a}=n,l=s.map(h=>h*c),u=[];try{const h=I(i,i.R16F,l,i.LINEAR);u.push(h);const f=Array.from({length:n.colours},()=>{const m=I(i,i.RGBA8,l,i.LINEAR);return u.push(m),m}),d=new ne(e,n);for(let m=0;m<s[2];m++){const p=d.layer(m);D(i);const w=(v,y,E,_)=>{i.bindTexture(i.TEXTURE_3D,v),i.texSubImage3D(i.TEXTURE_3D,0,0,0,m*c,l[0],l[1],c,y,E,_)};if(w(h,i.RED,i.HALF_FLOAT,p.density),p.colours.forEach((v,y)=>w(f[y],i.RGBA,i.UNSIGNED_BYTE,v)),i.bindTexture(i.TEXTURE_3D,null),await new Promise(v=>setTimeout(v)),!r())throw new Error("not wanted any more")}D(i);const x=I(i,i.RGBA8UI,[a[2],a[1],a[0]],i.NEAREST);return u.push(x),i.texSubImage3D(i.TEXTURE_3D,0,0,0,0,a[2],a[1],a[0],i.RGBA_INTEGER,i.UNSIGNED_BYTE,n.index),i.bindTexture(i.TEXTURE_3D,null),{layout:n,density:h,colours:f,index:x,bytes:o}}catch(h){for(const f of u)i.deleteTexture(f);if(!r())return null;throw h}}function P(i,{dims:e,codes:t}){D(i);const r=I(i,i.R16UI,[e[2],e[1],e[0]],i.NEAREST);return i.texSubImage3D(i.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],i.RED_INTEGER,i.UNSIGNED_SHORT,t),i.bindTexture(i.TEXTURE_3D,null),r}function se(i,e){for(const t of[e.density,e.index,...e.colours])i.deleteTexture(t)}class k{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}held=[];length=0;arrived=0;source;async take(e){for(;this.length<e;){const{value:n,done:o}=await this.source.read();if(o)throw new Error("the file of the field is truncated");this.held.push(n),this.length+=n.length,this.arrived+=n.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let r=0;for(;r<e;){const n=this.held[0],o=n.subarray(0,e-r);t.set(o,r),r+=o.length,o.length===n.length?this.held.shift():this.held[0]=n.subarray(o.length)}return this.length-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function ce(i){const e=new Blob([i]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class U{constructor(e,t,r){this.header=e,this.entries=t,this.reader=r}next=0;static async open(e,t,r){const n=await e.take(16),o=new DataView(n.buffer);if(String.fromCharCode(...n.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const s=o.getUint32(8,!0);if(s!==r)throw new Error(`"${t}" of version ${s}, this page reads ${r}; reload it`);const c=new TextDecoder().decode(await e.take(o.getUint32(12,!0))),a=JSON.parse(c);return new U(a,a.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const r=await ce(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(r);case"u2":return new Uint16Array(r);case"i4":return new Int32Array(r);case"f4":return new Float32Array(r)}}}const ae="cagepage",le=1;async function*he(i,e){const t=new k(i,e);try{const r=await U.open(t,ae,le);for(const[n,o]of r.header.levels.entries()){const s=await r.read(`${n}.bricks`),c=await r.read(`${n}.masks`),a=await r.read(`${n}.occupancy`),l=await r.read(`${n}.density`),u=await r.read(`${n}.sh`);yield{field:r.header,header:o,last:n===r.header.levels.length-1,bricks:s,masks:c,density:B(l),sh:fe(u,o.vertices),occupancy:{origin:[0,0,0],dims:o.dims,codes:a}}}}finally{t.cancel()}}function B(i){const e=i.length/2,t=new Uint16Array(e);for(let r=0;r<e;r++)t[r]=i[r]|i[e+r]<<8;return t}function fe(i,e){for(let t=0;t<i.length;t+=e){let r=128;for(let n=t;n<t+e;n++)i[n]=r=r+i[n]&255}return i}const ue=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)"];function de(i){const e=Math.ceil(3*i/4),t=[`uniform float coefficientSteps[${i}];`,...Array.from({length:e},(r,n)=>`uniform sampler3D colourAtlas${n};`),"vec3 colourAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(r,n)=>`  vec4 s${n} = 255.0 * textureLod(colourAtlas${n}, at, 0.0) - 128.0;`)];for(let r=0;r<i;r++){const n=[0,1,2].map(o=>`s${3*r+o>>2}.${"xyzw"[3*r+o&3]}`);t.push(`  rgb += (coefficientSteps[${r}] * (${ue[r]})) * vec3(${n.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colours:e}}const G=`#version 300 es
void main() {
  vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(at, 0.0, 1.0);
}`,xe=`
uniform sampler3D densityAtlas;
uniform usampler3D brickIndex;
uniform usampler3D bricks;
uniform vec3 atlasScale;
uniform ivec3 indexDims;
uniform ivec3 bricksOrigin;
uniform ivec3 bricksDims;
uniform ivec3 resolution;
uniform vec3 lower;
uniform vec3 scale;
uniform vec3 halfGrid;
uniform float unit;
uniform float marchStep;
uniform float near;
uniform vec3 background;
uniform vec3 eye;
uniform mat3 rotation;
uniform vec4 lens;
uniform float height;
layout(location = 0) out vec4 outColour;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
layout(location = 2) out vec4 outNormal;
#endif

vec3 contract(vec3 q) {
  float m = max(max(max(abs(q.x), abs(q.y)), abs(q.z)), 1.0);
  return ((2.0 - 1.0 / m) / m) * q;
}

vec3 contractVelocity(vec3 q, vec3 d) {
  vec3 a = abs(q);
  float m = max(max(a.x, a.y), a.z);
  if (m <= 1.0) return d;
  float dm = d.x * sign(q.x);
  if (a.y >= m) dm = d.y * sign(q.y);
  if (a.z >= m) dm = d.z * sign(q.z);
  return ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q;
}

vec2 slab(vec3 origin, vec3 inverse_, vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse_;
  vec3 b = (high - origin) * inverse_;
  vec3 first = min(a, b);
  vec3 last = max(a, b);
  return vec2(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

vec3 safeInverse(vec3 d) { return 1.0 / mix(d, vec3(1e-12), lessThan(abs(d), vec3(1e-12))); }

float emptyRun(vec3 g, vec3 inverse_) {
  ivec3 cell = ivec3(floor(g)) - bricksOrigin;
  ivec3 b = clamp(cell >> 2, ivec3(0), bricksDims - 1);
  int code = int(texelFetch(bricks, b.zyx, 0).r);
  ivec3 low;
  int size;
  if (code >= 256) {
    int d = code >> 8;
    low = (b - (d - 1)) * 4;
    size = (2 * d - 1) * 4;
  } else {
    ivec3 s = (cell >> 1) & 1;
    if (((code >> (s.x * 4 + s.y * 2 + s.z)) & 1) == 1) return -1.0;
    low = (cell >> 1) << 1;
    size = 2;
  }
  vec3 lo = vec3(low + bricksOrigin);
  vec3 last = max((lo - g) * inverse_, (lo + float(size) - g) * inverse_);
  return max(min(min(last.x, last.y), last.z), 0.0);
}

vec3 toGrid(vec3 p) {
  vec3 g = (p - lower) * scale;
#ifdef CONTRACTED
  g = (contract(g) + 2.0) * halfGrid;
#endif
  return g;
}

// The texel, whole where a vertex is, of grid coordinates in the atlas; false where their brick is empty.
bool locate(vec3 g, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 place = texelFetch(brickIndex, b.zyx, 0);
  corner = ivec3(place.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return place.a > 0u;
}

// Gradient of the interpolated density in grid coordinates.
vec3 densitySlope(vec3 texel, ivec3 corner) {
  ivec3 cell = corner + min(ivec3(texel) - corner, ivec3(BRICK - 1));
  vec3 f = texel - vec3(cell);
  vec3 e = 1.0 - f;
  float r000 = texelFetch(densityAtlas, cell, 0).r;
  float r100 = texelFetch(densityAtlas, cell + ivec3(1, 0, 0), 0).r;
  float r010 = texelFetch(densityAtlas, cell + ivec3(0, 1, 0), 0).r;
  float r110 = texelFetch(densityAtlas, cell + ivec3(1, 1, 0), 0).r;
  float r001 = texelFetch(densityAtlas, cell + ivec3(0, 0, 1), 0).r;
  float r101 = texelFetch(densityAtlas, cell + ivec3(1, 0, 1), 0).r;
  float r011 = texelFetch(densityAtlas, cell + ivec3(0, 1, 1), 0).r;
  float r111 = texelFetch(densityAtlas, cell + ivec3(1, 1, 1), 0).r;
  return vec3(
    (r001 - r000) * e.x * e.y + (r101 - r100) * f.x * e.y + (r011 - r010) * e.x * f.y + (r111 - r110) * f.x * f.y,
    (r010 - r000) * e.x * e.z + (r110 - r100) * f.x * e.z + (r011 - r001) * e.x * f.z + (r111 - r101) * f.x * f.z,
    (r100 - r000) * e.y * e.z + (r110 - r010) * f.y * e.z + (r101 - r001) * e.y * f.z + (r111 - r011) * f.y * f.z
  ) * unit;
}

vec3 pullBack(vec3 slope, vec3 q) {
  return vec3(
    dot(slope, contractVelocity(q, vec3(1.0, 0.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 1.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 0.0, 1.0)))
  );
}
`,me=`
// Rounded here, and put amid the step: some GPUs cut off where others round.
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec3 d = rotation * normalize(vec3((pixel - lens.zw) / lens.xy * vec2(1.0, -1.0), -1.0));
  vec3 go = (eye - lower) * scale;
  vec3 gd = d * scale;
  vec3 inverse_ = safeInverse(gd);
  float t = near;
  float end = 1e30;
#ifndef CONTRACTED
  vec3 lo = vec3(bricksOrigin);
  vec2 hit = slab(go, inverse_, lo, lo + 4.0 * vec3(bricksDims));
  t = max(hit.x, near) + 0.5 * marchStep;
  end = hit.y;
#endif
#ifdef EDITED
  vec2 edited = editedPart(eye, d);
#endif
  float T = 1.0;
  vec3 rgb = vec3(0.0);
  vec3 normal = vec3(0.0);
  float depth = 0.0;
#ifdef COUNT
  int samples = 0;
  int reads = 0;
#endif
  while (t < end && T > 1e-3) {
    vec3 g = go + t * gd;
    float h = marchStep;
    float leap = 0.0;
#ifdef CONTRACTED
    vec3 q = g;
    vec3 v = contractVelocity(q, gd) * halfGrid;
    g = (contract(q) + 2.0) * halfGrid;
    h = marchStep / max(max(abs(v.x), abs(v.y)), abs(v.z));
    float m = max(max(abs(q.x), abs(q.y)), abs(q.z));
    if (m > 2.0 * halfGrid.x) end = t;
    float run = emptyRun(g, safeInverse(v));
    if (run >= 0.0) {
      leap = m > 1.0 ? min(0.5 * run, 0.25 * m / max(max(abs(gd.x), abs(gd.y)), abs(gd.z))) : run;
      leap = max(leap, h);
    }
#else
    float run = emptyRun(g, inverse_);
    if (run >= 0.0) leap = (floor(run / marchStep) + 1.0) * marchStep;
#endif
#ifdef COUNT
    reads += 1;
#endif
    if (run >= 0.0) {
      t += leap;
      continue;
    }
    bool alive = true;
    bool moved = false;
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      bool emptied = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (emptied) alive = false;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, texel, corner)) {
      vec3 at = (texel + 0.5) * atlasScale;
      float raw = textureLod(densityAtlas, at, 0.0).r * unit;
#ifdef COUNT
      samples += 1;
      reads += 2;
#endif
      if (raw > 0.0) {
#ifdef EDITED
        if (moved && preserveOpacity) raw *= length(view);
#endif
        float keep = exp(-raw * h);
        float w = T * (1.0 - keep);
        T *= keep;
        if (w > 1e-4) {
          vec3 c = colourAt(at, view / max(length(view), 1e-20));
#ifdef COUNT
          reads += COLOURS;
#endif
          rgb += w * clamp(c, 0.0, 1.0);
          depth += w * t;
#ifdef NORMALS
          vec3 slope = densitySlope(texel, corner);
#ifdef CONTRACTED
          slope = pullBack(slope * halfGrid, MOVED_POINT) * scale;
#else
          slope *= scale;
#endif
#ifdef EDITED
          if (moved) slope = throughEdits(slope, eye + t * d);
#endif
          normal -= w * slope / max(length(slope), 1e-12);
#endif
        }
      }
    }
    t += h;
  }
  float opacity = 1.0 - T;
  outColour = eightBits(vec4(rgb + T * background, opacity));
#ifdef COUNT
  outDepth = uint(reads / 4) << 16 | uint(samples);
#else
  outDepth = floatBitsToUint(opacity > 1e-6 ? depth / opacity : intBitsToFloat(0x7f800000));
#endif
#ifdef NORMALS
  float size = length(normal);
  outNormal = eightBits(vec4(size > 1e-6 ? 0.5 + 0.5 * normal / size : vec3(0.5), opacity));
#endif
}
`;function pe(i,e){const{source:t,colours:r}=de(i.K),n=[`#define BRICK ${e}`,`#define COLOURS ${r}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return i.contracted&&n.push("#define CONTRACTED"),i.edited&&n.push("#define EDITED"),i.normals&&n.push("#define NORMALS"),i.count&&n.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...n,xe,t,i.edited?ee(i.edits):"",me].join(`
`)}class ve{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get colour(){return this.textures?.colour??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={colour:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{colour:r,depth:n,normals:o}=this.textures;for(const[s,c]of[r,n,o].entries())c&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+s,t.TEXTURE_2D,c,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:r,height:n}=this,o=new Uint8Array(4*r*n),s=e&&this.textures?.normals?new Uint8Array(4*r*n):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,r,n,t.RGBA,t.UNSIGNED_BYTE,o),s&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,r,n,t.RGBA,t.UNSIGNED_BYTE,s)),t.bindFramebuffer(t.FRAMEBUFFER,null);const c=this.readDepth();return{width:r,height:n,rgba:O(o,4*r),depth:c,normals:s&&O(s,4*r)}}readDepth(){const{gl:e,width:t,height:r}=this,n=new Uint32Array(t*r);if(e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.pixelStorei(e.PACK_ALIGNMENT,1),e.readBuffer(e.COLOR_ATTACHMENT1),e.getParameter(e.IMPLEMENTATION_COLOR_READ_FORMAT)===e.RED_INTEGER)e.readPixels(0,0,t,r,e.RED_INTEGER,e.UNSIGNED_INT,n);else{const o=new Uint32Array(4*t*r);e.readPixels(0,0,t,r,e.RGBA_INTEGER,e.UNSIGNED_INT,o);for(let s=0;s<n.length;s++)n[s]=o[4*s]}return e.bindFramebuffer(e.FRAMEBUFFER,null),O(new Float32Array(n.buffer),t)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const r of Object.values(t))e.deleteTexture(r);e.deleteFramebuffer(this.framebuffer),this.forget()}texture(e,t){const{gl:r}=this,n=r.createTexture();return r.bindTexture(r.TEXTURE_2D,n),r.texStorage2D(r.TEXTURE_2D,1,e,this.width,this.height),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MIN_FILTER,t),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MAG_FILTER,t),r.bindTexture(r.TEXTURE_2D,null),n}}function O(i,e){const t=i.length/e;for(let r=0;r<t>>1;r++){const[n,o]=[r*e,(t-1-r)*e],s=i.slice(n,n+e);i.copyWithin(n,o,o+e),i.set(s,o)}return i}const ye=768*2**20,we=`#version 300 es
precision highp float;
uniform sampler2D picture;
uniform vec2 size;
out vec4 colour;
void main() { colour = vec4(texture(picture, gl_FragCoord.xy / size).rgb, 1.0); }`;class X{constructor(e,t=ye){this.gl=e,this.memory=t,this.targets=new ve(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;compileTime=0;shown=null;onGpu=null;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shown?.level??null}get active(){return this.edited&&this.shown?.level.last?this.onGpu:null}get bytes(){return this.shown?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const r=++this.loading,n=()=>r===this.loading;let o=0;for await(const s of he(e,t.onArrival)){if(await this.take(s,n),!n())return;t.onLevel?.(++o,s.field.levels.length)}}async restore(){const{shown:e,onGpu:t}=this;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shown=this.onGpu=null,this.targets.forget();const r=++this.loading;e&&await this.take(e.level,()=>r===this.loading),this.setEdits(t?.edits??null)}setEdits(e){const{gl:t}=this;if(this.onGpu&&(t.deleteBuffer(this.onGpu.buffer),t.deleteTexture(this.onGpu.lattice),t.deleteTexture(this.onGpu.occupancy),this.onGpu=null),e===null||e.edits===0)return;if(e.rows.length>4*1024)throw new Error("more edits than the page's shader holds");const r=t.createBuffer();t.bindBuffer(t.UNIFORM_BUFFER,r),t.bufferData(t.UNIFORM_BUFFER,16*1024,t.STATIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e.rows),t.bindBuffer(t.UNIFORM_BUFFER,null),this.onGpu={edits:e,buffer:r,lattice:this.uploadLattice(e),occupancy:P(t,e.occupancy)}}render(e={}){const{gl:t,shown:r,camera:n,active:o}=this;if(!r||!n||t.isContextLost())return!1;const{level:s,textures:c}=r,{width:a,height:l}=this.targets,u={K:s.header.steps.length,contracted:s.field.contracted,edited:o!==null,edits:o&&Q(o.edits.edits),normals:e.normals??!1,count:e.count??!1},{program:h,uniform:f}=this.program(u,s.field.brick);this.targets.bind(u.normals),t.useProgram(h),t.bindVertexArray(this.vertices),this.plainState(),this.setField(f,r),this.setView(f,n);let d=0;const x=(w,v,y)=>{t.activeTexture(t.TEXTURE0+d),t.bindTexture(v,y),t.uniform1i(f(w),d++)};x("densityAtlas",t.TEXTURE_3D,c.density),x("brickIndex",t.TEXTURE_3D,c.index),x("bricks",t.TEXTURE_3D,o?.occupancy??r.occupancy),c.colours.forEach((w,v)=>x(`colourAtlas${v}`,t.TEXTURE_3D,w)),o&&(x("lattice",t.TEXTURE_2D,o.lattice),t.uniform1i(f("editCount"),o.edits.edits),t.uniform1i(f("boxCount"),o.edits.boxes),t.uniform1i(f("preserveOpacity"),Number(o.edits.preserveOpacity)),t.uniformBlockBinding(h,t.getUniformBlockIndex(h,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,o.buffer));const{first:m,count:p}=e.rows??{first:0,count:l};return t.enable(t.SCISSOR_TEST),t.scissor(0,m,a,p),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),this.unbind(),!0}show(e,t,r=null){const{gl:n}=this,o=this.cached("show",()=>F(n,G,we));n.bindFramebuffer(n.FRAMEBUFFER,r),n.viewport(0,0,e,t),n.useProgram(o.program),n.bindVertexArray(this.vertices),this.plainState(),n.activeTexture(n.TEXTURE0),n.bindTexture(n.TEXTURE_2D,this.targets.colour),n.uniform1i(o.uniform("picture"),0),n.uniform2f(o.uniform("size"),e,t),n.drawArrays(n.TRIANGLES,0,3),this.unbind()}read(e=!1){return this.targets.read(e)}readDepth(){return this.targets.readDepth()}dispose(){this.loading++,this.setEdits(null),this.drop(),this.targets.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const r=await oe(this.gl,e,this.memory,t);r!==null&&(this.drop(),this.shown={level:e,textures:r,occupancy:P(this.gl,e.occupancy)})}drop(){this.shown&&(se(this.gl,this.shown.textures),this.gl.deleteTexture(this.shown.occupancy),this.shown=null)}uploadLattice({lattice:e}){const{gl:t}=this,r=Math.max(1,Math.ceil(e.length/(3*2048))),n=new Uint16Array(3*2048*r);n.set(e),D(t);const o=t.createTexture();return t.bindTexture(t.TEXTURE_2D,o),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,2048,r),L(t,t.TEXTURE_2D,t.NEAREST),t.texSubImage2D(t.TEXTURE_2D,0,0,0,2048,r,t.RGB,t.HALF_FLOAT,n),t.bindTexture(t.TEXTURE_2D,null),o}program(e,t){return this.cached(JSON.stringify([e,t]),()=>{const r=F(this.gl,G,pe(e,t));return this.compileTime=r.milliseconds,r})}cached(e,t){let r=this.programs.get(e);return r||(r=t(),this.programs.set(e,r)),r}setField(e,{level:t,textures:r}){const{gl:n,active:o}=this,{bounds:s,contracted:c}=t.field,{resolution:a,unit:l,steps:u}=t.header,{across:h,edge:f,dims:d}=r.layout,m=s[1].map((E,_)=>E-s[0][_]).map((E,_)=>c?2/E:(a[_]-1)/E),p=s[0].map((E,_)=>c?.5*(E+s[1][_]):E),{origin:w,dims:v}=o?.edits.occupancy??t.occupancy,y=this.step??t.field.step;n.uniform3f(e("atlasScale"),1/(h[0]*f),1/(h[1]*f),1/(h[2]*f)),n.uniform3i(e("indexDims"),...d),n.uniform3i(e("bricksOrigin"),...w),n.uniform3i(e("bricksDims"),...v),n.uniform3i(e("resolution"),...a),n.uniform3fv(e("lower"),p),n.uniform3fv(e("scale"),m),n.uniform3fv(e("halfGrid"),a.map(E=>(E-1)/4)),n.uniform1f(e("unit"),l),n.uniform1f(e("marchStep"),c?y:y/Math.max(...m)),n.uniform1fv(e("coefficientSteps"),u)}setView(e,t){const{gl:r}=this,{width:n,height:o}=this.targets,{c2w:s}=t,c=n/t.width,a=o/t.height;r.uniform3f(e("eye"),s[3],s[7],s[11]),r.uniformMatrix3fv(e("rotation"),!0,[s[0],s[1],s[2],s[4],s[5],s[6],s[8],s[9],s[10]]),r.uniform4f(e("lens"),t.fx*c,t.fy*a,t.cx*c,t.cy*a),r.uniform1f(e("height"),o),r.uniform1f(e("near"),this.near),r.uniform3f(e("background"),...this.background)}plainState(){const{gl:e}=this;for(const t of[e.BLEND,e.DEPTH_TEST,e.CULL_FACE,e.STENCIL_TEST,e.SCISSOR_TEST,e.DITHER])e.disable(t);e.colorMask(!0,!0,!0,!0),e.depthMask(!1)}unbind(){const{gl:e}=this;for(let t=15;t>=0;t--)e.activeTexture(e.TEXTURE0+t),e.bindTexture(e.TEXTURE_2D,null),e.bindTexture(e.TEXTURE_3D,null);e.bindVertexArray(null),e.bindFramebuffer(e.FRAMEBUFFER,null),e.useProgram(null)}}async function $(i){const e=new k(i),{header:t,...r}=await Ee(e),n=await r.read("rows"),o=B(await r.read("lattice")),s=await r.read("occupancy");return{edits:t.edits,boxes:t.boxes,preserveOpacity:t.preserve_opacity,rows:n,lattice:o,occupancy:{origin:t.origin,dims:t.dims,codes:s}}}async function Ee(i){const e=await U.open(i,"cageedit",1);return{header:e.header,read:t=>e.read(t)}}const C=[1,.75,.5,.35,.25,.18,.12];class Te{constructor(e=28,t=40){this.moving=e,this.part=t}cost=null;took(e,t){const r=t/Math.max(1,e);this.cost=this.cost===null?r:this.cost+.3*(r-this.cost)}scale(e,t){const{cost:r}=this;return r===null?.25:C.find(n=>r*e*t*n*n<=this.moving)??C[C.length-1]}rows(e,t){return this.cost===null?16:Math.max(4,Math.min(t,Math.floor(this.part/Math.max(1e-9,this.cost*e))))}}async function ge(i){const e=performance.now(),t=i.fenceSync(i.SYNC_GPU_COMMANDS_COMPLETE,0);if(i.flush(),t===null)return 0;for(;!i.isContextLost()&&i.clientWaitSync(t,0,0)===i.TIMEOUT_EXPIRED;)await new Promise(r=>setTimeout(r,1));return i.deleteSync(t),performance.now()-e}function be(i,e){const t=new Map;i.style.touchAction="none",i.addEventListener("contextmenu",r=>r.preventDefault()),i.addEventListener("pointerdown",r=>{i.setPointerCapture(r.pointerId),t.set(r.pointerId,{x:r.clientX,y:r.clientY,shifts:r.button!==0||r.shiftKey})});for(const r of["pointerup","pointercancel"])i.addEventListener(r,n=>t.delete(n.pointerId));i.addEventListener("pointermove",r=>{const n=t.get(r.pointerId);if(!n)return;const[o,s]=[r.clientX-n.x,r.clientY-n.y],c=[...t.entries()].find(([a])=>a!==r.pointerId)?.[1];if(c){const a=Math.hypot(n.x-c.x,n.y-c.y),l=Math.hypot(r.clientX-c.x,r.clientY-c.y);e.shift(o/2,s/2),a>1&&l>1&&e.zoom(a/l)}else n.shifts?e.shift(o,s):e.turn(o,s);n.x=r.clientX,n.y=r.clientY}),i.addEventListener("wheel",r=>{r.preventDefault();const n=r.deltaMode===WheelEvent.DOM_DELTA_LINE?30:1;e.zoom(Math.exp(.0012*n*r.deltaY))},{passive:!1})}const T=(i,e,t=1)=>[i[0]+t*e[0],i[1]+t*e[1],i[2]+t*e[2]],g=(i,e)=>T(i,e,-1),z=(i,e)=>[e*i[0],e*i[1],e*i[2]],R=(i,e)=>i[0]*e[0]+i[1]*e[1]+i[2]*e[2],M=(i,e)=>[i[1]*e[2]-i[2]*e[1],i[2]*e[0]-i[0]*e[2],i[0]*e[1]-i[1]*e[0]],W=i=>Math.hypot(...i),A=i=>z(i,1/Math.max(1e-30,W(i)));function H(i,e,t){const[r,n]=[Math.cos(t),Math.sin(t)];return T(T(z(i,r),M(e,i),n),e,R(e,i)*(1-r))}const b=(i,e)=>[i[e],i[4+e],i[8+e]];function q(i,e,t,r){return[0,1,2].flatMap(n=>[i[n],e[n],t[n],r[n]]).concat(0,0,0,1)}const V=.02;class K{constructor(e,t,r){this.up=t,this.eye=b(e,3);const n=z(b(e,2),-1);this.target=T(this.eye,n,Math.max(R(g(r,this.eye),n),.001))}eye;target;get c2w(){const e=A(g(this.eye,this.target)),t=A(M(this.up,e));return q(t,M(e,t),e,this.eye)}turn(e,t){const r=H(g(this.eye,this.target),this.up,-e),n=A(M(this.up,r)),o=Math.acos(Math.max(-1,Math.min(1,R(A(r),this.up)))),s=Math.max(V,Math.min(Math.PI-V,o-t))-o;this.eye=T(this.target,H(r,n,s))}shift(e,t,r){const n=2*r*W(g(this.eye,this.target)),{c2w:o}=this,s=T(z(b(o,0),-e*n),b(o,1),t*n);this.eye=T(this.eye,s),this.target=T(this.target,s)}zoom(e){this.eye=T(this.target,g(this.eye,this.target),e)}}function _e({stills:i,seconds:e,loop:t},r){const n=e>0?r/e:1,o=i.length-1,s=t?n%1*i.length:Math.min(n,1)*o,c=i[Math.min(Math.floor(s),o)],a=i[t?(Math.floor(s)+1)%i.length:Math.min(Math.floor(s)+1,o)],l=s-Math.floor(s),u=x=>T(b(c.c2w,x),g(b(a.c2w,x),b(c.c2w,x)),l),h=A(u(2)),f=u(1),d=A(g(f,[h[0]*R(f,h),h[1]*R(f,h),h[2]*R(f,h)]));return{c2w:q(M(d,h),d,h,u(3)),fov_y_deg:c.fov_y_deg+l*(a.fov_y_deg-c.fov_y_deg)}}const Re=120,Ae=2;class Me{constructor(e,t,r){this.canvas=e,this.header=t,this.say=r;const n=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!n)throw new Error("This browser has no WebGL2, which the scene is drawn with.");this.gl=n,this.renderer=new X(n),this.renderer.background=t.background??[1,1,1],this.orbit=new K(t.start.c2w,t.up,t.centre),this.fov=t.start.fov_y_deg,be(e,{turn:(o,s)=>this.change(()=>this.orbit.turn(Math.PI*o/e.clientHeight,Math.PI*s/e.clientHeight)),shift:(o,s)=>this.change(()=>this.orbit.shift(o/e.clientHeight,s/e.clientHeight,this.tangent)),zoom:o=>this.change(()=>this.orbit.zoom(o))}),e.addEventListener("webglcontextlost",o=>o.preventDefault()),e.addEventListener("webglcontextrestored",()=>void this.renderer.restore().then(()=>this.touch())),new ResizeObserver(()=>this.touch()).observe(e)}renderer;orbit;gl;pacing=new Te;fov;moved=performance.now();row=0;playing=null;async run(e,t){t&&this.renderer.setEdits(await $(t)),this.draw(),await this.renderer.load(e,{onLevel:(r,n)=>{this.say(r<n?"Loading detail …":""),this.touch()}})}get whole(){return this.row===null}get edited(){return this.renderer.edited}set edited(e){this.renderer.edited=e,this.touch()}get plays(){return this.playing!==null}play(e){this.playing=e&&this.header.path?performance.now():null,this.touch()}home(){this.look(this.header.start),this.playing=null}get tangent(){return Math.tan(this.fov*Math.PI/360)}look(e){this.orbit=new K(e.c2w,this.header.up,this.header.centre),this.fov=e.fov_y_deg,this.touch()}change(e){this.playing=null,e(),this.touch()}touch(){this.moved=performance.now(),this.row=0}async draw(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{await this.frame()}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}async frame(){const{canvas:e,gl:t,renderer:r,pacing:n}=this,{path:o}=this.header;if(this.playing!==null&&o){const p=(performance.now()-this.playing)/1e3;this.look(_e(o,p)),!o.loop&&p>=o.seconds&&(this.playing=null)}if(this.row===null)return;const s=Math.min(devicePixelRatio,Ae),[c,a]=[e.clientWidth,e.clientHeight].map(p=>Math.max(1,Math.round(p*s)));(e.width!==c||e.height!==a)&&Object.assign(e,{width:c,height:a});const l=n.scale(c,a),u=performance.now()-this.moved>Re||l===1,h=u?[c,a]:[c,a].map(p=>Math.max(8,Math.round(p*l)));this.aim(h[0],h[1]);const f=u?this.row:0,d=u?Math.min(n.rows(c,a),a-f):h[1],x=this.moved;if(!r.render({rows:{first:f,count:d}}))return;const m=f+d>=h[1];m&&r.show(c,a),n.took(h[0]*d,await ge(t)),this.moved===x&&u&&(this.row=m?null:f+d)}aim(e,t){const r=.5*Math.min(e,t)/this.tangent;this.renderer.setSize(e,t),this.renderer.setCamera({c2w:this.orbit.c2w,width:e,height:t,fx:r,fy:r,cx:e/2,cy:t/2})}}window.cagefieldViewer={FieldRenderer:X,readEdits:$};function S(i){const e=document.querySelector(i);if(!e)throw new Error(`the page has no ${i}`);return e}function Y(i){const e=document.getElementById(i);if(!e)return null;const t=atob(e.textContent.trim());e.remove();const r=new Uint8Array(t.length);for(let n=0;n<t.length;n++)r[n]=t.charCodeAt(n);return r.buffer}async function Se(i){const e=S(".message"),t=r=>void(e.textContent=r);try{const r=new Me(S("canvas"),i,t);window.cagefieldViewer.viewer=r;const[n,o,s]=[S(".compare"),S(".play"),S(".home")],c=Y("field"),a=Y("edits");if(n.hidden=a===null,o.hidden=i.path===null,n.onclick=()=>{r.edited=!r.edited,n.textContent=r.edited?"Show before":"Show after"},o.onclick=()=>r.play(!r.plays),s.onclick=()=>r.home(),setInterval(()=>void(o.textContent=r.plays?"Stop":"Play"),200),window.addEventListener("keydown",({key:l})=>{l==="b"&&n.click(),l===" "&&o.click(),l==="h"&&s.click()}),c===null)throw new Error("the file holds no field; export the scene again");await r.run(c,a)}catch(r){t(r instanceof Error?r.message:String(r))}}const j=document.getElementById("scene");j&&Se(JSON.parse(j.textContent))})();
